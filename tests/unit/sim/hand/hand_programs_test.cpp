// The hand does what its program says.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "hal/sim/hand/hand_motion.h"
#include "tests/unit/sim/virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::VirtualRig;

std::string named(const std::string& object, double value) {
  return object + "_" + std::to_string(std::lround(value));
}

TEST(RestingHand, HoldsTheToolAboveTheObject) {
  VirtualRig rig({.object = "foam_ball"});
  rig.run(1.0);
  rig.run(5.0, [&] {
    ASSERT_FALSE(rig.truth().in_contact);
    ASSERT_NEAR(rig.truth().tip_position_mm.z, 10.0, 0.2);
    ASSERT_LT(std::hypot(rig.truth().tip_position_mm.x, rig.truth().tip_position_mm.y), 0.2);
    ASSERT_LT(test::length(rig.truth().hand_force_n), 0.2);
  });
}

class Press : public testing::TestWithParam<std::tuple<std::string, double>> {};
/// Every object with 4 N; the softest, a middle one and the hardest also with 1 N.
std::vector<std::tuple<std::string, double>> presses() {
  std::vector<std::tuple<std::string, double>> all{
      {"sponge_block", 1.0}, {"rubber_ball", 1.0}, {"wood_plate", 1.0}};
  for (const std::string& object : object_preset_names()) all.emplace_back(object, 4.0);
  return all;
}
INSTANTIATE_TEST_SUITE_P(Objects, Press, testing::ValuesIn(presses()), [](const auto& tested) {
  return named(std::get<0>(tested.param), std::get<1>(tested.param));
});

TEST_P(Press, ReachesItsForceAndLetsGoAgain) {
  const auto& [object, force_n] = GetParam();
  VirtualRig rig(
      {.object = object},
      {.kind = HandProgram::Kind::kPress, .force_n = force_n, .force_rate_n_per_s = 2.0, .hold_s = 4.0});
  const double load_s = 1.875 * force_n / 2.0;
  double touched_s = 0.0, max_n = 0.0;
  while (touched_s == 0.0 && rig.time_s() < 5.0) {
    rig.tick();
    if (rig.truth().in_contact) touched_s = rig.time_s();
  }
  ASSERT_GT(touched_s, 0.0);
  double sum_n = 0.0;
  int ticks = 0;
  rig.run(load_s + 3.9, [&] {
    max_n = std::max(max_n, -rig.truth().hand_force_n.z);
    // Soft matter creeps, and a hand corrects no faster than with a time constant of about 0.5 s.
    if (rig.time_s() > touched_s + load_s + 2.9) {
      sum_n -= rig.truth().hand_force_n.z;
      ++ticks;
    }
  });
  EXPECT_NEAR(sum_n / ticks, force_n, 0.03 * force_n);
  EXPECT_LT(max_n, 1.15 * force_n + 0.2);
  rig.run(3.0);
  EXPECT_FALSE(rig.truth().in_contact);
  EXPECT_NEAR(rig.truth().tip_position_mm.z, 10.0, 0.3);
}

TEST(PressByDepth, ReachesItsDepth) {
  for (const char* object : {"sponge_block", "rubber_eraser"}) {
    const double depth_mm = std::string(object) == "sponge_block" ? 6.0 : 1.0;
    VirtualRig rig({.object = object},
                   {.kind = HandProgram::Kind::kPress, .depth_mm = depth_mm, .hold_s = -1.0});
    rig.run(5.0);
    double sum_mm = 0.0;
    int ticks = 0;
    rig.run(1.0, [&] {
      sum_mm += rig.truth().displacement_mm;
      ++ticks;
    });
    EXPECT_NEAR(sum_mm / ticks, depth_mm, 0.03 * depth_mm) << object;
  }
}

TEST(HandProgram, IsDoneWhenTheToolIsFreeAgainAndNotBefore) {
  VirtualRig rig({});
  const HandProgram press{.kind = HandProgram::Kind::kPress,
                          .force_n = 1.0,
                          .force_rate_n_per_s = 4.0,
                          .hold_s = 0.3,
                          .repetitions = 2};
  for (const HandProgram::Kind kind : {HandProgram::Kind::kPress, HandProgram::Kind::kTap,
                                       HandProgram::Kind::kStroke, HandProgram::Kind::kRest}) {
    HandProgram program = press;
    program.kind = kind;
    const double longest_s = 1.1 * planned_duration_s(program) + 0.5;
    rig.set_program(program);
    EXPECT_FALSE(rig.rig().hand_is_done()) << "set, but not yet taken up";
    bool touched = false;
    double done_s = 0.0;
    const double began_s = rig.time_s();
    rig.run(longest_s, [&] {
      touched = touched || rig.truth().in_contact;
      if (!rig.rig().hand_is_done()) return;
      if (done_s == 0.0) done_s = rig.time_s() - began_s;
      EXPECT_FALSE(rig.truth().in_contact);
    });
    EXPECT_EQ(touched, kind != HandProgram::Kind::kRest);
    EXPECT_GT(done_s, 0.0) << "within " << longest_s << " s";
  }
}

TEST(HandProgram, IsNeverDoneWhereItGoesOnAndBeginsAgainOverAnotherObject) {
  VirtualRig rig({});
  for (const HandProgram& program :
       {HandProgram{.kind = HandProgram::Kind::kPress, .force_n = 1.0, .hold_s = -1.0},
        HandProgram{.kind = HandProgram::Kind::kTap, .repetitions = -1},
        HandProgram{.kind = HandProgram::Kind::kWeight}, HandProgram{.kind = HandProgram::Kind::kFollow}}) {
    rig.set_program(program);
    rig.run(6.0, [&] { ASSERT_FALSE(rig.rig().hand_is_done()); });
  }
  rig.set_program({.kind = HandProgram::Kind::kPress, .force_n = 1.0, .hold_s = 3.0});
  rig.run(4.0, [&] { ASSERT_FALSE(rig.rig().hand_is_done()); });
  rig.set_object("rubber_ball");  // the hand lifts off, and presses again
  rig.run(2.0, [&] { ASSERT_FALSE(rig.rig().hand_is_done()); });
}

TEST(PressRepeated, TouchesAsOftenAsAsked) {
  VirtualRig rig({}, {.kind = HandProgram::Kind::kPress,
                      .force_n = 1.0,
                      .force_rate_n_per_s = 4.0,
                      .hold_s = 0.3,
                      .repetitions = 3});
  int presses = 0;
  bool pressed = false;
  rig.run(20.0, [&] {
    const double normal_n = rig.truth().normal_force_n;
    if (!pressed && normal_n > 0.5) ++presses;
    pressed = pressed ? normal_n > 0.0 : normal_n > 0.5;
  });
  EXPECT_EQ(presses, 3);
}

// Every speed and every object; the fastest and the slowest on the softest and on the hardest.
using Tapped = std::tuple<std::string, double>;
class Tap : public testing::TestWithParam<Tapped> {};
INSTANTIATE_TEST_SUITE_P(Objects, Tap,
                         testing::Values(Tapped{"sponge_block", 100.0}, Tapped{"sponge_block", 1000.0},
                                         Tapped{"rubber_eraser", 400.0}, Tapped{"wood_plate", 100.0},
                                         Tapped{"wood_plate", 1000.0}),
                         [](const auto& tested) {
                           return named(std::get<0>(tested.param), std::get<1>(tested.param));
                         });

TEST_P(Tap, StrikesTheSurfaceAtItsSpeed) {
  const auto& object = std::get<0>(GetParam());
  const double speed_mm_per_s = std::get<1>(GetParam());
  VirtualRig rig(
      {.object = object, .rate_hz = 10000.0},
      {.kind = HandProgram::Kind::kTap, .speed_mm_per_s = speed_mm_per_s, .rate_hz = 1.0, .repetitions = 4});
  int taps = 0;
  bool armed = false;
  double last_mm = 0.0;
  rig.run(8.0, [&] {
    const double here_mm = rig.truth().tip_position_mm.z;
    if (here_mm > 5.0) armed = true;
    if (armed && rig.truth().in_contact) {
      // Slowed by less than 1 % in the one step since.
      EXPECT_NEAR((last_mm - here_mm) / 1e-4, speed_mm_per_s, 0.1 * speed_mm_per_s) << "tap " << taps;
      armed = false;
      ++taps;
    }
    last_mm = here_mm;
  });
  EXPECT_EQ(taps, 4);
}

// Every object and both devices; both devices on the hardest.
using Weighed = std::tuple<std::string, std::string>;
class Weight : public testing::TestWithParam<Weighed> {};
INSTANTIATE_TEST_SUITE_P(
    Devices, Weight,
    testing::Values(Weighed{"phantom_1_0", "sponge_block"}, Weighed{"phantom_1_5_high_force", "foam_ball"},
                    Weighed{"phantom_1_5_high_force", "rubber_eraser"}, Weighed{"phantom_1_0", "wood_plate"},
                    Weighed{"phantom_1_5_high_force", "wood_plate"}),
    [](const auto& tested) { return std::get<0>(tested.param) + "_" + std::get<1>(tested.param); });

TEST_P(Weight, RestsWithItsFourNewton) {
  const auto& [device, object] = GetParam();
  VirtualRig rig({.device = device, .object = object}, {.kind = HandProgram::Kind::kWeight});
  rig.run(25.0);
  const double weight_n = 0.408 * 9.807;
  const double friction_n = device_preset(device)->coulomb_friction_n;
  rig.run(0.5, [&] {
    ASSERT_NEAR(rig.truth().hand_force_n.z, -weight_n, 2e-3);
    // The device's own friction may carry a share of the weight or hold it down.
    ASSERT_NEAR(rig.truth().reaction_force_n.z, weight_n, friction_n + 2e-3);
  });
}

class Stroke : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Objects, Stroke, testing::Values("sponge_block", "rubber_eraser", "wood_plate"),
                         [](const auto& tested) { return tested.param; });

TEST_P(Stroke, MovesAlongAndKeepsItsForce) {
  VirtualRig rig({.object = GetParam()}, {.kind = HandProgram::Kind::kStroke,
                                          .force_n = 2.0,
                                          .force_rate_n_per_s = 4.0,
                                          .speed_mm_per_s = 80.0,
                                          .repetitions = -1,
                                          .stroke_direction = {3.0, 4.0, 0.0},
                                          .stroke_length_mm = 40.0});
  double furthest_mm = 0.0, nearest_mm = 0.0, last_mm = 0.0;
  double middle_sum_mm_per_s = 0.0;
  int middle_ticks = 0;
  double sum_n = 0.0, min_n = 1e9, max_n = 0.0;
  int ticks = 0;
  rig.run(12.0, [&] {
    const Vector3& tip = rig.truth().tip_position_mm;
    const double along_mm = 0.6 * tip.x + 0.8 * tip.y;
    ASSERT_NEAR(0.8 * tip.x - 0.6 * tip.y, 0.0, 0.3) << "straight";
    furthest_mm = std::max(furthest_mm, along_mm);
    nearest_mm = std::min(nearest_mm, along_mm);
    const double speed_mm_per_s = std::abs(along_mm - last_mm) / 1e-3;
    // Fastest in the middle, where the minimum-jerk motion has its peak; the first stroke breaks away and
    // starts half-way.
    if (rig.time_s() > 4.0 && std::abs(along_mm) < 3.0) {
      middle_sum_mm_per_s += speed_mm_per_s;
      ++middle_ticks;
    }
    last_mm = along_mm;
    if (speed_mm_per_s > 20.0 && rig.truth().in_contact) {
      sum_n += rig.truth().normal_force_n;
      min_n = std::min(min_n, rig.truth().normal_force_n);
      max_n = std::max(max_n, rig.truth().normal_force_n);
      ++ticks;
    }
  });
  ASSERT_GT(ticks, 1000);
  // The hand's spring yields to friction by μN/k, at most 3.5 mm here.
  EXPECT_NEAR(furthest_mm, 20.0, 3.5);
  EXPECT_NEAR(nearest_mm, -20.0, 3.5);
  EXPECT_NEAR(middle_sum_mm_per_s / middle_ticks, 80.0, 0.1 * 80.0);
  EXPECT_NEAR(sum_n / ticks, 2.0, 0.1);
  EXPECT_GT(min_n, 1.6);
  EXPECT_LT(max_n, 2.4);
}

TEST(Shake, ActsAlongItsDirection) {
  VirtualRig rig({.object = "none"}, {.kind = HandProgram::Kind::kShake,
                                      .force_n = 1.0,
                                      .rate_hz = 5.0,
                                      .shake_direction = {3.0, 0.0, -4.0}});
  double max_n = 0.0, max_mm = 0.0;
  rig.run(3.0, [&] {
    const Vector3& force_n = rig.truth().device_force_n;
    ASSERT_NEAR(0.8 * force_n.x + 0.6 * force_n.z, 0.0, 1e-12);
    ASSERT_EQ(force_n.y, 0.0);
    max_n = std::max(max_n, test::length(force_n));
    max_mm = std::max(max_mm, std::abs(rig.truth().tip_position_mm.x));
  });
  EXPECT_NEAR(max_n, 1.0, 1e-3);
  EXPECT_GT(max_mm, 1.0);
}

class SlantedTap : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Slants, SlantedTap, testing::Values(20.0, 45.0, 60.0), [](const auto& tested) {
  return std::to_string(std::lround(tested.param)) + "_deg";
});

TEST_P(SlantedTap, MeetsTheSurfaceAtHomeUnderItsAngle) {
  constexpr double kSpeed = 300.0;
  VirtualRig rig({.object = "rubber_eraser", .rate_hz = 10000.0}, {.kind = HandProgram::Kind::kTap,
                                                                   .speed_mm_per_s = kSpeed,
                                                                   .rate_hz = 1.0,
                                                                   .repetitions = 4,
                                                                   .stroke_direction = {0.6, -0.8, 0.0},
                                                                   .tap_slant_deg = GetParam()});
  const double slant = std::tan(GetParam() * 3.14159265358979 / 180.0);
  Vector3 last_mm = rig.truth().tip_position_mm;
  bool armed = false;
  int taps = 0;
  double fastest_mm_per_s = 0.0;
  rig.run(8.0, [&] {
    const Vector3 tip_mm = rig.truth().tip_position_mm;
    const Vector3 moved_mm = tip_mm - last_mm;
    if (rig.time_s() > 1e-3) fastest_mm_per_s = std::max(fastest_mm_per_s, test::length(moved_mm) / 1e-4);
    if (tip_mm.z > 5.0) armed = true;
    if (armed && rig.truth().in_contact) {
      armed = false;
      ++taps;
      EXPECT_LT(std::hypot(tip_mm.x, tip_mm.y), 0.5 + 0.02 * slant * kSpeed);
      EXPECT_NEAR(moved_mm.z / 1e-4, -kSpeed, 0.1 * kSpeed);
      const double along_mm = 0.6 * moved_mm.x - 0.8 * moved_mm.y;
      EXPECT_NEAR(along_mm / moved_mm.z, slant, 0.1 * slant);
      EXPECT_NEAR((0.8 * moved_mm.x + 0.6 * moved_mm.y) / 1e-4, 0.0, 5.0) << "in its plane";
    }
    last_mm = tip_mm;
  });
  EXPECT_EQ(taps, 4);
  EXPECT_LT(fastest_mm_per_s, 1.3 * kSpeed * std::sqrt(1.0 + slant * slant)) << "no jump on the way there";
}

struct Sticking {
  double still = 0.0;  ///< share of the time, slower than 1 mm/s
  int jumps = 0;       ///< from rest to five times the hand's fastest
};

Sticking sticking(const char* object) {
  constexpr double kSpeed = 12.0;
  VirtualRig rig({.object = object}, {.kind = HandProgram::Kind::kStroke,
                                      .force_n = 2.0,
                                      .force_rate_n_per_s = 4.0,
                                      .speed_mm_per_s = kSpeed,
                                      .repetitions = -1,
                                      .stroke_length_mm = 60.0});
  rig.run(8.0);
  Sticking found;
  int still_ticks = 0, ticks = 0;
  bool rested = false;
  Vector3 last_mm = rig.truth().tip_position_mm;
  rig.run(30.0, [&] {
    const double speed_mm_per_s = test::length(rig.truth().tip_position_mm - last_mm) / 1e-3;
    last_mm = rig.truth().tip_position_mm;
    if (speed_mm_per_s < 1.0) {
      ++still_ticks;
      rested = true;
    } else if (rested && speed_mm_per_s > 5.0 * kSpeed) {
      ++found.jumps;
      rested = false;
    }
    ++ticks;
  });
  found.still = static_cast<double>(still_ticks) / ticks;
  return found;
}

TEST(StickSlip, GelSticksAndJumpsWhereSiliconeSlides) {
  const Sticking gel = sticking("sticky_gel");
  const Sticking silicone = sticking("silicone_rest");
  EXPECT_GE(gel.jumps, 12) << "three strokes of 60 mm in jumps of a centimetre";
  EXPECT_GT(gel.still, 0.5);
  EXPECT_EQ(silicone.jumps, 0);
  EXPECT_LT(silicone.still, 0.4) << "where the stroke turns round";
}

TEST(BallBearing, RollsWithAFractionOfTheRodsFriction) {
  for (const char* object : {"sponge_block", "rubber_eraser", "silicone_rest", "wood_plate"}) {
    const ObjectModel model = *object_preset(object);
    for (const Tip tip : {Tip::kRod, Tip::kBallBearing}) {
      VirtualRig rig({.object = object, .tip = tip == Tip::kRod ? "rod" : "ball_bearing"},
                     {.kind = HandProgram::Kind::kStroke,
                      .force_n = 2.0,
                      .force_rate_n_per_s = 4.0,
                      .speed_mm_per_s = 60.0,
                      .repetitions = -1,
                      .stroke_length_mm = 40.0});
      rig.run(4.0);
      double sum = 0.0;
      int ticks = 0;
      Vector3 last_mm = rig.truth().tip_position_mm;
      rig.run(10.0, [&] {
        const double speed_mm_per_s = test::length(rig.truth().tip_position_mm - last_mm) / 1e-3;
        last_mm = rig.truth().tip_position_mm;
        if (speed_mm_per_s < 30.0 || !rig.truth().in_contact) return;
        sum += rig.truth().friction_force_n / rig.truth().normal_force_n -
               model.friction_with(tip).viscous_s_per_mm * speed_mm_per_s;
        ++ticks;
      });
      ASSERT_GT(ticks, 1000);
      const double kinetic = model.friction_with(tip).kinetic;
      EXPECT_NEAR(sum / ticks, kinetic, 0.1 * kinetic)
          << object << " " << tip_names()[static_cast<std::size_t>(tip)];
    }
  }
}

TEST(Knock, DisturbsAStrokeToo) {
  const HandProgram even{.kind = HandProgram::Kind::kStroke,
                         .force_n = 2.0,
                         .force_rate_n_per_s = 8.0,
                         .speed_mm_per_s = 80.0,
                         .repetitions = -1,
                         .stroke_length_mm = 30.0};  // shorter than the knocks' period
  HandProgram knocked = even;
  knocked.knock_n = 3.0;
  VirtualRig calm({}, even), disturbed({}, knocked);
  std::vector<double> knocks_s;
  double before_n = 0.0;
  while (calm.time_s() < 10.0) {
    calm.tick();
    disturbed.tick();
    // The force of the hand jumps and nothing else does; what follows a knock decays.
    const double difference_n = disturbed.truth().hand_force_n.z - calm.truth().hand_force_n.z;
    if (difference_n - before_n > 0.2 && (knocks_s.empty() || calm.time_s() > knocks_s.back() + 0.5)) {
      knocks_s.push_back(calm.time_s());
    }
    before_n = difference_n;
  }
  ASSERT_GE(knocks_s.size(), 2U);
  for (std::size_t i = 1; i < knocks_s.size(); ++i) EXPECT_NEAR(knocks_s[i] - knocks_s[i - 1], 2.0, 5e-3);
}

TEST(Knock, DisturbsEveryTwoSecondsForTwentyMilliseconds) {
  const HandProgram still{.kind = HandProgram::Kind::kWeight};
  HandProgram knocked = still;
  knocked.knock_n = 3.0;
  VirtualRig calm({.rate_hz = 10000.0}, still), disturbed({.rate_hz = 10000.0}, knocked);
  double impulse_n_s = 0.0, first_s = 0.0;
  while (calm.time_s() < 3.0) {
    calm.tick();
    disturbed.tick();
    // Hand force and its acceleration make the support of a bare mass, whatever the motion: compare at once.
    const double difference_n = disturbed.truth().hand_force_n.z - calm.truth().hand_force_n.z;
    if (first_s == 0.0 && difference_n != 0.0) first_s = calm.time_s();
    if (first_s > 0.0 && calm.time_s() < first_s + 5e-4) impulse_n_s += difference_n * 1e-4;
  }
  EXPECT_NEAR(first_s, 2.0, 2e-3);
  EXPECT_GT(impulse_n_s, 0.0) << "upwards";
}

TEST(HandProgram, AFirmerGripIsStifferAndDampsMoreButAWeightHasNone) {
  HandProgram press{.kind = HandProgram::Kind::kPress};
  const HandImpedance usual = impedance_of(press);
  press.grip_stiffness_scale = 2.0;
  press.grip_damping_scale = 3.0;
  const HandImpedance firm = impedance_of(press);
  EXPECT_DOUBLE_EQ(firm.stiffness_n_per_mm, 2.0 * usual.stiffness_n_per_mm);
  EXPECT_DOUBLE_EQ(firm.lateral_damping_n_s_per_mm, 3.0 * usual.lateral_damping_n_s_per_mm);
  EXPECT_EQ(firm.mass_kg, usual.mass_kg);
  press.kind = HandProgram::Kind::kWeight;
  EXPECT_EQ(impedance_of(press).damping_n_s_per_mm, 0.0);
}

}  // namespace
}  // namespace hapticd::sim
