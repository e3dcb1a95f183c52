// What identification needs of the simulated rig: places, light taps, sway, a bend that varies, a tool that
// hangs off-centre, an instrument from outside.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "hal/sim/sensor/external_instrument.h"
#include "tests/support/turn.h"
#include "virtual_rig.h"

namespace hapticd::sim {
namespace {

using hal::Vector3;
using test::inverse;
using test::turned;
using test::VirtualRig;

constexpr Vector3 kPlace{60.0, -40.0, 30.0};

TEST(Place, RestTapAndPressHappenThere) {
  VirtualRig rest({.object = "none"}, {.place_mm = kPlace, .travel_s = 1.0});
  rest.run(1.5);
  EXPECT_LT(test::length(rest.truth().tip_position_mm - (kPlace + Vector3{0.0, 0.0, 10.0})), 0.3);

  VirtualRig tap(
      {.object = "none"},
      {.kind = HandProgram::Kind::kTap, .speed_mm_per_s = 200.0, .repetitions = 1, .place_mm = kPlace});
  double lowest = 1e9, speed_there = 0.0, before = 0.0;
  bool ready = false;  // at its height above the place
  tap.run(8.0, [&] {
    const Vector3& p = tap.truth().tip_position_mm;
    if (before > kPlace.z && p.z <= kPlace.z) speed_there = (before - p.z) * 1e3;
    before = p.z;
    ready = ready || p.z > kPlace.z + 12.0;
    if (ready && p.z < lowest) {
      lowest = p.z;
      EXPECT_NEAR(p.x, tap.time_s() > 4.0 ? kPlace.x : p.x, 0.3);
    }
  });
  // It means to turn 3 mm below its own surface; speed over the hand's 50 rad/s carries it up to 4 mm
  // further.
  EXPECT_LT(lowest, kPlace.z - 2.0);
  EXPECT_GT(lowest, kPlace.z - 7.0) << "through its own surface, not that of the table";
  EXPECT_NEAR(speed_there, 200.0, 30.0);
}

TEST(Place, APressSeeksItsForceAtAPlaceOfTheObject) {
  const HandProgram press{.kind = HandProgram::Kind::kPress,
                          .force_n = 2.0,
                          .force_rate_n_per_s = 4.0,
                          .hold_s = 1.0,
                          .repetitions = 1,
                          .place_mm = {15.0, 10.0, 0.0},
                          .travel_s = 1.0};
  VirtualRig rig({.object = "sponge_block"}, press);
  double max_n = 0.0;
  const double over_s = planned_duration_s(press);
  bool clear_at_the_end = false;
  rig.run(over_s, [&] {
    max_n = std::max(max_n, rig.truth().normal_force_n);
    if (rig.truth().in_contact) {
      ASSERT_NEAR(rig.truth().tip_position_mm.x, 15.0, 0.5);
      ASSERT_NEAR(rig.truth().tip_position_mm.y, 10.0, 0.5);
    }
    clear_at_the_end = !rig.truth().in_contact;
  });
  EXPECT_GT(max_n, 1.8);
  EXPECT_TRUE(clear_at_the_end) << "the planned duration covers it";
}

class EveryProgram : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Programs, EveryProgram, testing::Range(0, 6));

TEST_P(EveryProgram, IsOverWhenItsPlanSays) {
  HandProgram p{.force_n = 3.0,
                .force_rate_n_per_s = 6.0,
                .approach_mm_per_s = 40.0,
                .hold_s = 0.5,
                .repetitions = 2,
                .stroke_length_mm = 30.0,
                .place_mm = {-20.0, 0.0, 0.0},
                .travel_s = 1.0};
  const int tested = GetParam();
  p.kind = tested < 2    ? HandProgram::Kind::kTap
           : tested < 4  ? HandProgram::Kind::kPress
           : tested == 4 ? HandProgram::Kind::kStroke
                         : HandProgram::Kind::kScan;
  p.speed_mm_per_s = tested == 0 ? 20.0 : tested == 1 ? 60.0 : tested == 5 ? 30.0 : 80.0;
  if (tested == 3) p.force_n = 8.0;
  if (tested == 5) p.repetitions = 12;
  for (const char* object : {"sponge_block", "foam_ball_3d"}) {
    VirtualRig rig({.object = object}, p);
    rig.run(planned_duration_s(p));
    double lowest = 1e9;
    bool touched = false;
    rig.run(1.0, [&] {
      touched = touched || rig.truth().in_contact;
      lowest = std::min(lowest, rig.truth().tip_position_mm.z);
    });
    EXPECT_FALSE(touched) << object << ": free and over";
  }
}

TEST(Scan, TouchesLightlyAlongTheLineAndComesBackUp) {
  const HandProgram scan{.kind = HandProgram::Kind::kScan,
                         .speed_mm_per_s = 40.0,
                         .repetitions = 10,
                         .stroke_length_mm = 36.0,
                         .place_mm = {-18.0, 0.0, 0.0},
                         .travel_s = 1.0};
  for (const char* object : {"foam_ball_3d", "rubber_ball_3d", "sponge_cut"}) {
    VirtualRig rig({.object = object}, scan);
    std::set<int> touched;
    double max_n = 0.0;
    int taps = 0;
    bool before = false;
    rig.run(planned_duration_s(scan), [&] {
      const bool now = rig.truth().in_contact;
      if (now && !before) ++taps;
      before = now;
      if (!now) return;
      touched.insert(static_cast<int>(std::lround((rig.truth().tip_position_mm.x + 18.0) / 4.0)));
      max_n = std::max(max_n, rig.truth().normal_force_n);
    });
    EXPECT_GE(touched.size(), 9U) << object;
    EXPECT_GE(taps, 9) << object;
    EXPECT_LT(max_n, 1.5) << object;
  }
}

TEST(Scan, AsksForANumberOfTaps) {
  VirtualRig rig({});
  EXPECT_THROW(rig.set_program({.kind = HandProgram::Kind::kScan, .repetitions = -1}), std::invalid_argument);
  EXPECT_THROW(rig.set_program({.place_mm = {500.0, 0.0, 0.0}}), std::invalid_argument);
  EXPECT_THROW(rig.set_program({.travel_s = -1.0}), std::invalid_argument);
  EXPECT_THROW(rig.set_program({.place_mm = {0.0, std::nan(""), 0.0}}), std::invalid_argument);
}

TEST(Sway, WavesEachWayAndDiesDown) {
  VirtualRig rig({.object = "none"}, {.kind = HandProgram::Kind::kSway,
                                      .speed_mm_per_s = 150.0,
                                      .rate_hz = 1.2,
                                      .hold_s = 5.0,
                                      .place_mm = {0.0, 0.0, 80.0},
                                      .travel_s = 1.0,
                                      .tilt_deg = 40.0});
  rig.run(2.0);
  Vector3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  double tilt = 0.0;
  rig.run(4.0, [&] {
    const Vector3& p = rig.truth().tip_position_mm;
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    tilt = std::max(tilt, 2.0 * std::acos(std::min(1.0, rig.sample().tip_orientation.w)));
  });
  const double amplitude = 150.0 / (2.0 * 3.14159265 * 1.2);
  EXPECT_NEAR(high.x - low.x, 2.0 * amplitude, 0.15 * amplitude);
  EXPECT_GT(high.y - low.y, amplitude);
  EXPECT_GT(high.z - low.z, amplitude);
  EXPECT_GT(tilt, 0.6);
  rig.run(1.5);
  Vector3 last = rig.truth().tip_position_mm;
  rig.run(0.5);
  EXPECT_LT(test::length(rig.truth().tip_position_mm - last), 0.2) << "over";
}

TEST(StructuralField, BendsAsMuchAsItsExponentialSays) {
  const Vector3 gradient{0.002, -0.001, 0.0};
  for (const Vector3 place : {Vector3{0.0, 0.0, 0.0}, Vector3{80.0, 0.0, 0.0}, Vector3{-80.0, 60.0, 0.0}}) {
    VirtualRig rig({.object = "none", .structural_gradient_per_mm = gradient, .external_instrument = false},
                   {.place_mm = place, .travel_s = 1.0});
    rig.run(2.0);
    Vector3 bend;
    rig.run(1.0, {0.0, 0.0, 0.0});
    constexpr double kForceN = 3.0;
    rig.run(2.0, {0.0, 0.0, kForceN});
    int ticks = 0;
    rig.run(1.0,
            [&] {
              bend = bend + (rig.sample().tip_position_mm - rig.truth().tip_position_mm);
              ++ticks;
            },
            {0.0, 0.0, kForceN});
    const double expected = kForceN / 3.5 * std::exp(gradient.x * place.x + gradient.y * place.y);
    // Dry friction of the motors keeps up to 0.06 N for itself.
    EXPECT_NEAR(bend.z / ticks, expected, expected * 0.06 / kForceN + 0.01) << place.x;
  }
}

TEST(ExternalInstrument, SeesTheTipWithinItsThirtyMicrometres) {
  VirtualRig rig({.object = "none"}, {.kind = HandProgram::Kind::kShake, .force_n = 2.0, .rate_hz = 3.0});
  double most = 0.0;
  rig.run(3.0, [&] {
    Vector3 seen;
    ASSERT_TRUE(rig.rig().external_position(seen));
    const Vector3 off = seen - rig.truth().tip_position_mm;
    most = std::max({most, std::abs(off.x), std::abs(off.y), std::abs(off.z)});
  });
  EXPECT_LT(most, 0.045);
  EXPECT_GT(most, 0.015) << "it is no perfect instrument";
  bool reported = false;
  for (const hal::UncertainParameter& u : rig.rig().info().uncertain)
    reported = reported || u.name == "external_noise_mm";
  EXPECT_TRUE(reported);
}

TEST(ExternalInstrument, WatchingChangesNothing) {
  VirtualRig with({.external_instrument = true}, {.kind = HandProgram::Kind::kTap});
  VirtualRig without({.external_instrument = false}, {.kind = HandProgram::Kind::kTap});
  for (int i = 0; i < 2000; ++i) {
    with.tick();
    without.tick();
    ASSERT_EQ(with.sample().tip_position_mm.z, without.sample().tip_position_mm.z);
    ASSERT_EQ(with.sample().sensor_force_n.x, without.sample().sensor_force_n.x);
  }
  Vector3 seen;
  EXPECT_FALSE(without.rig().external_position(seen));
}

TEST(Mounting, AtRestUprightItReadsItsOffsetsOnly) {
  const Vector3 force{0.3, -0.2, 0.1}, torque{4.0, -3.0, 2.0};
  VirtualRig rig({.object = "none",
                  .tool_mass_g = 30.0,
                  .tool_centre_mm = Vector3{2.0, 3.0, -20.0},
                  .sensor_force_offset_n = force,
                  .sensor_torque_offset_n_mm = torque,
                  .sensor_to_tool = {std::sqrt(0.5), std::sqrt(0.5), 0.0, 0.0}});
  rig.run(2.0);
  Vector3 forces, torques;
  int ticks = 0;
  rig.run(10.0, [&] {
    forces = forces + rig.sample().sensor_force_n;
    torques = torques + rig.sample().sensor_torque_n_mm;
    ++ticks;
  });
  EXPECT_LT(test::length(forces * (1.0 / ticks) - force), 2e-3);
  EXPECT_LT(test::length(torques * (1.0 / ticks) - torque), 0.05);
}

TEST(Mounting, WeightActsAtTheCentreAndReadsInTheSensorsFrame) {
  const Vector3 centre{5.0, -4.0, -25.0};
  const double half = std::sqrt(0.5);
  VirtualRig rig({.object = "none",
                  .tool_mass_g = 50.0,
                  .tool_centre_mm = centre,
                  .sensor_to_tool = {half, 0.0, 0.0, half}},
                 {.kind = HandProgram::Kind::kRest, .tilt_deg = 30.0});
  rig.run(2.0);
  double square_force = 0.0, square_torque = 0.0;
  int ticks = 0;
  const Vector3 weight{0.0, 0.0, -0.05 * 9.807};
  const hal::Quaternion mounting{half, 0.0, 0.0, half};
  rig.run(20.0, [&] {
    const Vector3 in_tool = turned(inverse(rig.sample().tip_orientation), weight);
    const Vector3 force = turned(inverse(mounting), in_tool - weight);
    const Vector3 torque =
        turned(inverse(mounting), test::cross(centre, in_tool) - test::cross(centre, weight));
    const Vector3 df = rig.sample().sensor_force_n - force, dt = rig.sample().sensor_torque_n_mm - torque;
    square_force += dot(df, df);
    square_torque += dot(dt, dt);
    ++ticks;
  });
  // The mass is carried round the tip: 35 mm at up to 3 rad/s² leave up to 6 mN besides.
  EXPECT_LT(std::sqrt(square_force / ticks), 0.012);
  EXPECT_LT(std::sqrt(square_torque / ticks), 0.35);
}

TEST(Mounting, AbsurdOnesAreRefused) {
  for (const SimulationConfig& config : {SimulationConfig{.tool_centre_mm = Vector3{0.0, 0.0, -500.0}},
                                         SimulationConfig{.sensor_force_offset_n = {50.0, 0.0, 0.0}},
                                         SimulationConfig{.sensor_to_tool = {2.0, 0.0, 0.0, 0.0}},
                                         SimulationConfig{.structural_gradient_per_mm = {1.0, 0.0, 0.0}},
                                         SimulationConfig{.structural_curvature_per_mm2 = {1.0}}}) {
    EXPECT_FALSE(SimulatedRig::create(config));
  }
}

}  // namespace
}  // namespace hapticd::sim
