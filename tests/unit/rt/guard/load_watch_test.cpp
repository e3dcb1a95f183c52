#include "rt/guard/load_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "rt/guard/guard.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {
namespace {

constexpr double kMassG = 12.6;
constexpr hal::Vector3 kAxes[] = {{1.0, 0.0, 0.0},  {0.0, 1.0, 0.0},  {0.0, 0.0, 1.0},
                                  {-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {0.0, 0.0, -1.0}};

/// A tool on a hand's path, with encoders of 0.03 mm and a sensor with 3 mN of noise; its motion, its zero
/// and what it touches are the test's.
class Tool {
 public:
  explicit Tool(double rate_hz = 1000.0) : period_s_(1.0 / rate_hz) {
    watch.set_parameters({kMassG, {}, {}, false});
    sample.bias_serial = 1;
  }
  /// Waved ±20 mm at 2.2 Hz along all axes, from within half a second on.
  void wave() { swing(20.0); }
  void rest() {
    swing(0.0);
    run(0.6);
  }
  void run(double seconds) {
    for (const double until_s = time_s + seconds; time_s < until_s - 1e-9;) tick();
  }
  void tick() {
    ++ticks_;
    double step_s = period_s_;
    if (late_s > 0.0 && ticks_ % 47 == 0) step_s += late_s;
    if (late_s > 0.0 && ticks_ % 47 == 1) step_s -= late_s;
    time_s += step_s;
    place_ = path(time_s);
    constexpr double dt = 1e-3;
    const hal::Vector3 a = (path(time_s + dt) + path(time_s - dt) - path(time_s) * 2.0) * (1.0 / (dt * dt));
    const auto counted = [](double mm) { return 0.03 * std::round(mm / 0.03); };
    sample.tip_position_mm = {counted(place_.x), counted(place_.y), counted(place_.z)};
    sample.sensor_force_n = zero_n + load_n - a * inertial_force_n(kMassG, 1.0) +
                            hal::Vector3{noise_(random_), noise_(random_), noise_(random_)};
    sample.time_ns += static_cast<std::int64_t>(1e9 * step_s);
    watch.update(sample, step_s);
  }
  /// Settles in free air, its zero proven.
  void settle() {
    wave();
    run(1.0);
    ASSERT_FALSE(watch.is_waiting());
  }

  LoadWatch watch;
  hal::RigSample sample;
  hal::Vector3 zero_n;
  hal::Vector3 load_n;
  hal::Vector3 offset_mm;
  double time_s = 0.0;
  double late_s = 0.0;  ///< of each 47th tick

 private:
  void swing(double amplitude_mm) {
    amplitude_from_mm_ = amplitude_at(time_s);
    amplitude_mm_ = amplitude_mm;
    swing_from_s_ = time_s;
  }
  double amplitude_at(double t) const {  // minimum jerk
    const double x = std::clamp((t - swing_from_s_) / 0.5, 0.0, 1.0);
    return amplitude_from_mm_ +
           (amplitude_mm_ - amplitude_from_mm_) * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
  }
  hal::Vector3 path(double t) const {
    const double w = 2.0 * std::numbers::pi * 2.2;
    return offset_mm +
           hal::Vector3{std::sin(w * t), std::sin(1.1 * w * t + 1.0), std::sin(0.9 * w * t + 2.0)} *
               amplitude_at(t);
  }

  double period_s_;
  int ticks_ = 0;
  double amplitude_mm_ = 0.0;
  double amplitude_from_mm_ = 0.0;
  double swing_from_s_ = -1.0;
  hal::Vector3 place_;
  std::mt19937 random_{5};
  std::normal_distribution<double> noise_{0.0, 0.003};
};

TEST(LoadWatch, ABiasIsProvenByMotionInFreeAirAndNotByRest) {
  Tool tool;
  tool.run(2.0);
  EXPECT_TRUE(tool.watch.is_waiting());
  EXPECT_FALSE(tool.watch.has_jumped());
  tool.wave();
  tool.run(0.5);
  EXPECT_FALSE(tool.watch.is_waiting());
  EXPECT_LT(norm(tool.watch.jump_n()), 0.02);
}

TEST(LoadWatch, WavedInFreeAirItShowsNoLoad) {
  for (const double rate_hz : {500.0, 1000.0, 5000.0}) {
    Tool tool(rate_hz);
    tool.settle();
    for (int i = 0; i < static_cast<int>(5.0 * rate_hz); ++i) {
      tool.tick();
      ASSERT_GT(tool.watch.unloaded_s(), 0.02) << rate_hz << " Hz, " << tool.time_s;
      ASSERT_FALSE(tool.watch.is_waiting());
    }
    EXPECT_EQ(tool.watch.jump_count(), 0U);
  }
}

TEST(LoadWatch, WavedWithALateClockTheToolsInertiaIsNoJump) {
  for (const double late_s : {0.3e-3, 0.9e-3}) {
    Tool tool;
    tool.settle();
    tool.late_s = late_s;
    tool.run(30.0);
    EXPECT_EQ(tool.watch.jump_count(), 0U) << late_s;
    EXPECT_LT(norm(tool.watch.jump_n()), 0.02) << late_s;
  }
}

TEST(LoadWatch, TheToolsWeightIsNoLoadInAnyOrientation) {
  Tool tool;
  tool.settle();
  tool.rest();
  for (int i = 0; i < 6000; ++i) {
    const double half = 0.5 * 3.0 * 1e-3 * i / 6.0;
    tool.sample.tip_orientation = {std::cos(half), std::sin(half), 0.0, 0.0};
    const hal::Vector3 weight{0.0, 0.0, -inertial_force_n(kMassG, 9807.0)};
    tool.zero_n = rotated(conjugate(tool.sample.tip_orientation), weight) - weight;
    tool.tick();
    ASSERT_GT(tool.watch.unloaded_s(), 0.02) << i;
  }
}

TEST(LoadWatch, AJumpOfAnySizeAndAxisIsNoLoadForLongAndIsTakenOver) {
  for (const bool waved : {false, true}) {
    for (const double size_n : {0.1, 0.15, 0.3, 1.0, 3.0}) {
      for (const hal::Vector3& axis : kAxes) {
        Tool tool;
        tool.settle();
        if (!waved) tool.rest();
        tool.run(0.3);
        tool.zero_n = axis * size_n;
        tool.run(0.002);
        EXPECT_TRUE(tool.watch.is_suspected() || tool.watch.is_waiting()) << size_n;
        tool.run(0.006);
        EXPECT_EQ(tool.watch.jump_count(), 1U) << size_n << waved;
        EXPECT_NEAR(norm(tool.watch.last_jump_n()), size_n, 0.1 * size_n + 0.015);
        tool.wave();
        tool.run(1.2);
        EXPECT_FALSE(tool.watch.is_waiting()) << size_n;
        EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.015) << size_n;
      }
    }
  }
}

/// A spring of this stiffness that is met along -z at this speed.
void meet(Tool& tool, double n_per_mm, double mm_per_s, double depth_mm) {
  const double surface_mm = tool.offset_mm.z - 10.0;
  int felt_ms = 0;
  for (double mm = 0.0; mm < 10.0 + depth_mm; mm += 1e-3 * mm_per_s) {
    tool.offset_mm.z -= 1e-3 * mm_per_s;
    tool.load_n = {0.0, 0.0, n_per_mm * std::max(0.0, surface_mm - tool.offset_mm.z)};
    tool.tick();
    felt_ms = tool.load_n.z > 0.2 ? felt_ms + 1 : 0;
    if (felt_ms > 4) {
      ASSERT_LT(tool.watch.unloaded_s(), 0.004) << n_per_mm << " N/mm at " << mm_per_s << " mm/s";
    }
    ASSERT_FALSE(tool.watch.is_waiting());
  }
  EXPECT_EQ(tool.watch.jump_count(), 0U) << n_per_mm << " N/mm at " << mm_per_s << " mm/s";
  // Held, and left.
  tool.run(0.01);
  for (int i = 0; i < 3000; ++i) {
    tool.tick();
    ASSERT_LT(tool.watch.unloaded_s(), 0.004);
  }
  for (int i = 0; i < 1000; ++i) {
    tool.offset_mm.z += 0.02;
    tool.load_n = {0.0, 0.0, n_per_mm * std::max(0.0, surface_mm - tool.offset_mm.z)};
    tool.tick();
  }
  EXPECT_EQ(tool.watch.jump_count(), 0U) << n_per_mm << " N/mm, left";
  EXPECT_GT(tool.watch.unloaded_s(), 0.02);
}

TEST(LoadWatch, AnObjectIsALoadHowSoftOrHardAndFastItIsMet) {
  for (const double n_per_mm : {0.05, 0.3, 2.0, 10.0}) {
    for (const double mm_per_s : {5.0, 50.0, 300.0}) {
      Tool tool;
      tool.settle();
      tool.rest();
      tool.run(0.2);
      meet(tool, n_per_mm, mm_per_s, std::min(10.0, 4.0 / n_per_mm));
    }
  }
}

/// Pressed onto a spring along -z with 2 N, which takes 0.4 s, and held.
void press(Tool& tool) {
  for (int i = 0; i < 400; ++i) {
    tool.offset_mm.z -= 0.01;
    tool.load_n.z = 0.005 * (i + 1);
    tool.tick();
  }
  tool.run(0.2);
}

/// Whether a load is seen while a tool is pulled off an object, with 100 mm/s and then by 25 m/s², its
/// inertia alone. `exchanged`: meanwhile the scene is exchanged for one that says something else of the same
/// tool.
bool is_load_seen_when_pulled_off(bool exchanged) {
  Tool tool;
  tool.settle();
  tool.rest();
  press(tool);
  for (int i = 1; i <= 20; ++i) {
    tool.offset_mm.z += 0.1;
    tool.load_n.z = 2.0 - 0.1 * i;
    tool.tick();
  }
  constexpr double kMmPerS2 = 25e3;
  tool.load_n.z = -inertial_force_n(kMassG, kMmPerS2);
  bool is_seen = false;
  for (int i = 1; i <= 25; ++i) {
    tool.offset_mm.z += 0.1 + kMmPerS2 * (i - 0.5) * 1e-6;
    if (exchanged && i == 8) tool.watch.set_parameters({kMassG, {}, {0.0, 0.0, -0.1}, true, 3.0});
    tool.tick();
    is_seen = is_seen || (i > 3 && tool.watch.unloaded_s() == 0.0);
  }
  return is_seen;
}

TEST(LoadWatch, AnotherSceneWithTheSameToolForgetsNothing) {
  EXPECT_FALSE(is_load_seen_when_pulled_off(false));
  EXPECT_FALSE(is_load_seen_when_pulled_off(true));
}

/// Way into a spring of 0.3 N/mm until the load counts, mm. `shaken`: while an object was held before, some
/// seconds ago, the tip was moved back and forth faster than any hand can.
double way_until_load_mm(bool shaken) {
  Tool tool;
  tool.settle();
  tool.rest();
  press(tool);
  for (int i = 0; shaken && i < 20; ++i) {
    tool.offset_mm.x = i % 2 == 0 ? 20.0 : 0.0;
    tool.tick();
  }
  tool.offset_mm.x = 0.0;
  tool.load_n = {};  // the object has vanished
  tool.run(5.0);
  EXPECT_GT(tool.watch.unloaded_s(), 0.5);
  for (int i = 1; i < 200; ++i) {
    tool.offset_mm.z -= 0.03;
    tool.load_n.z += 0.009;
    tool.tick();
    if (tool.watch.unloaded_s() == 0.0) return 0.03 * i;
  }
  return HUGE_VAL;
}

TEST(LoadWatch, WhatShookTheToolIsForgottenWhileItIsFree) {
  const double untouched_mm = way_until_load_mm(false);
  EXPECT_LT(untouched_mm, 0.6);
  EXPECT_NEAR(way_until_load_mm(true), untouched_mm, 0.1);
}

/// Pressed onto a spring that bears little of what is felt: the reading relaxes from 70 to 42 mN while the
/// tip rests.
void press_what_bears_little(Tool& tool) {
  for (int i = 0; i < 200; ++i) {
    tool.offset_mm.z -= 0.01;
    tool.load_n.z = 0.07 * (i + 1) / 200.0;
    tool.tick();
  }
  for (int i = 0; i < 2000; ++i) {
    tool.load_n.z = 0.042 + 0.028 * std::exp(-i / 400.0);
    tool.tick();
    ASSERT_LT(tool.watch.unloaded_s(), 0.005) << i << " ms after the press";
  }
}

TEST(LoadWatch, WhatIsLeftOfALoadIsHeldWhileTheTipRests) {
  Tool tool;
  tool.settle();
  tool.rest();
  tool.run(0.2);
  press_what_bears_little(tool);
  // Gone, but for a zero that drifted meanwhile.
  tool.load_n.z = 0.02;
  tool.run(0.03);
  EXPECT_GT(tool.watch.unloaded_s(), 0.014);
}

TEST(LoadWatch, WhatIsLeftOfALoadIsNoneOnceTheTipHasLeft) {
  Tool tool;
  tool.settle();
  tool.rest();
  tool.run(0.2);
  press_what_bears_little(tool);
  for (int i = 0; i < 30; ++i) {
    tool.offset_mm.z += 0.05;
    tool.tick();
  }
  EXPECT_GT(tool.watch.unloaded_s(), 0.014);
}

TEST(LoadWatch, AKnockOnWhatIsHeldTakesNothingAway) {
  for (const double knock_n : {-1.0, 0.3, 1.0, 3.0}) {
    Tool tool;
    tool.settle();
    tool.rest();
    press(tool);
    tool.load_n.z += knock_n;
    for (int i = 0; i < 100; ++i) {
      tool.tick();
      ASSERT_LT(tool.watch.unloaded_s(), 0.004) << knock_n;
      ASSERT_FALSE(tool.watch.is_waiting()) << knock_n;
    }
    tool.load_n.z -= knock_n;
    tool.run(0.3);
    EXPECT_LT(tool.watch.unloaded_s(), 0.004) << knock_n;
    EXPECT_EQ(tool.watch.jump_count(), 0U) << knock_n;
  }
}

// The step of such an object is noted as a jump's is. What then looks like the step is the tool's inertia: as
// the sensor reads it, or as the encoders show it while the arm bends.
TEST(LoadWatch, AnObjectThatIsMovedUnderThePressIsNoJumpOnceTheToolIsThrown) {
  constexpr double kMmPerS2 = 40e3;
  for (const bool is_read : {true, false}) {
    Tool tool;
    tool.settle();
    tool.rest();
    press(tool);
    tool.load_n.z -= 0.4;
    tool.run(0.2);
    for (int i = 1; i <= 20; ++i) {
      tool.offset_mm.z += 0.1;
      tool.load_n.z -= 0.08;
      tool.tick();
    }
    tool.load_n.z = is_read ? -inertial_force_n(kMassG, kMmPerS2) : 0.1;
    for (int i = 1; i <= 30; ++i) {
      tool.offset_mm.z += (is_read ? kMmPerS2 : -kMmPerS2) * (i - 0.5) * 1e-6;
      tool.tick();
      ASSERT_EQ(tool.watch.jump_count(), 0U) << is_read << ", " << i << " ms after the object was left";
    }
  }
}

TEST(LoadWatch, AJumpUnderAPressCountsOnceTheObjectIsLeft) {
  for (const double jump_n : {0.2, 0.5, -0.5, 2.0}) {
    for (const double mm_per_s : {1.0, 2.0, 20.0, 100.0}) {
      Tool tool;
      tool.settle();
      tool.rest();
      press(tool);
      tool.zero_n.z = jump_n;
      tool.run(0.1);
      EXPECT_EQ(tool.watch.jump_count(), 0U) << jump_n;
      int left_ms = 0;
      for (int i = 0; i < (mm_per_s < 10.0 ? 6000 : 1000); ++i) {
        tool.offset_mm.z += 1e-3 * mm_per_s;
        tool.load_n.z = std::max(0.0, tool.load_n.z - 0.5e-3 * mm_per_s);
        tool.tick();
        left_ms = tool.load_n.z > 0.0 ? 0 : left_ms + 1;
        const bool is_free = tool.watch.is_waiting() || tool.watch.unloaded_s() > 0.01;
        if (left_ms > 15) {
          ASSERT_TRUE(is_free) << jump_n << " N, " << mm_per_s << " mm/s, " << left_ms << " ms";
        }
      }
      EXPECT_EQ(tool.watch.jump_count(), 1U) << jump_n << " N, " << mm_per_s << " mm/s";
      EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.03) << jump_n << " N, " << mm_per_s << " mm/s";
    }
  }
}

TEST(LoadWatch, ALateTickHidesNoJumpUnderAPress) {
  for (int after = 0; after < 47; after += 3) {  // where the late tick falls
    Tool tool;
    tool.settle();
    tool.rest();
    tool.late_s = 0.3e-3;
    press(tool);
    tool.run(0.1 + 1e-3 * after);
    tool.zero_n.x = 0.35;
    tool.run(0.3);
    for (int i = 0; i < 1000; ++i) {
      tool.offset_mm.z += 0.01;
      tool.load_n.z = std::max(0.0, tool.load_n.z - 0.01);
      tool.tick();
    }
    EXPECT_EQ(tool.watch.jump_count(), 1U) << after;
    EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.03) << after;
  }
}

// A stiff object that is struck steps as a zero that jumps does; how the reading grows tells them apart, but
// the zero stays wrong by the step until free air shows it.
TEST(LoadWatch, TheZeroBeforeAJumpStaysNothingUntilTheNewOneIsProven) {
  Tool tool;
  tool.settle();
  tool.rest();
  tool.load_n.z = 0.3;
  tool.run(0.03);
  ASSERT_EQ(tool.watch.jump_count(), 1U);
  for (int i = 0; i < 400 && tool.watch.is_waiting(); ++i) {
    tool.offset_mm.z -= 0.02;
    tool.load_n.z += 0.02;
    tool.tick();
  }
  ASSERT_FALSE(tool.watch.is_waiting());
  tool.run(0.05);
  EXPECT_LT(tool.watch.unloaded_s(), 0.004);
  ASSERT_GT(norm(tool.watch.jump_n()), 0.2);
  const double pressed_n = tool.load_n.z;
  for (int i = 0; i < 10; ++i) {
    tool.offset_mm.z += 0.1;
    tool.load_n.z = pressed_n * (0.9 - 0.1 * i);
    tool.tick();
  }
  for (int i = 0; i < 100; ++i) {
    tool.tick();
    ASSERT_TRUE(i < 5 || tool.watch.unloaded_s() > 1e-3 * (i - 5)) << i << " ms after the object was left";
  }
}

TEST(LoadWatch, WhatWasBiasedAwayUnderAPressIsTakenOverOnceItIsSeenInFreeAir) {
  for (const double press_n : {0.1, 0.4, 1.0, 3.0}) {
    Tool tool;
    tool.settle();
    tool.rest();
    tool.load_n = {0.0, 0.0, press_n};
    tool.run(0.5);
    ++tool.sample.bias_serial;
    tool.zero_n = {0.0, 0.0, -press_n};
    tool.run(0.5);
    EXPECT_TRUE(tool.watch.is_waiting()) << press_n;
    const double from_mm = tool.offset_mm.z;
    for (int i = 0; i < 1000; ++i) {  // a spring of 0.5 N/mm lets go
      tool.offset_mm.z += 0.01;
      tool.load_n.z = std::max(0.0, press_n - 0.5 * (tool.offset_mm.z - from_mm));
      tool.tick();
      if (tool.load_n.z > 0.0) {
        ASSERT_TRUE(tool.watch.is_waiting()) << press_n << ", " << tool.load_n.z;
      }
    }
    tool.wave();
    tool.run(0.5);
    EXPECT_FALSE(tool.watch.is_waiting()) << press_n;
    EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.03) << press_n;
  }
}

TEST(LoadWatch, AZeroThatDriftsIsFollowed) {
  Tool tool;
  tool.settle();
  tool.rest();
  for (int i = 0; i < 60'000; ++i) {
    tool.zero_n = {5e-6 * i, -5e-6 * i, 2e-6 * i};
    tool.tick();
    ASSERT_GT(tool.watch.unloaded_s(), 0.02) << i;
  }
  EXPECT_EQ(tool.watch.jump_count(), 0U);
}

TEST(LoadWatch, ALoadThatVanishesIsNoJump) {
  Tool tool;
  tool.settle();
  tool.rest();
  for (int i = 0; i < 200; ++i) {
    tool.offset_mm.z -= 0.05;
    tool.load_n.z = 0.01 * i;
    tool.tick();
  }
  tool.run(0.5);
  tool.load_n = {};
  tool.run(0.05);
  EXPECT_EQ(tool.watch.jump_count(), 0U);
  EXPECT_GT(tool.watch.unloaded_s(), 0.02);
}

TEST(LoadWatch, AStepAcrossALoadThatChangesIsNotedAsWell) {
  Tool tool;
  tool.settle();
  tool.rest();
  press(tool);
  for (int i = 0; i < 300; ++i) {  // it lets go by 25 N/s
    tool.offset_mm.z += 0.02;
    tool.load_n.z = std::max(0.0, tool.load_n.z - 0.025);
    if (i == 40) tool.zero_n.x = -0.3;
    tool.tick();
  }
  EXPECT_EQ(tool.watch.jump_count(), 1U);
  EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.03);
}

TEST(LoadWatch, AnArmThatSwingsShowsNoLoadAndAnObjectThatIsMetMeanwhileDoes) {
  for (const double swing_hz : {35.0, 60.0, 120.0}) {
    for (const bool is_met : {false, true}) {
      Tool tool;
      tool.watch.set_parameters({kMassG, {}, {}, false, 0.0, 0.4});
      tool.settle();
      tool.rest();
      tool.load_n.z = 10.0;
      tool.run(0.5);
      for (int i = 0; i < 200; ++i) {
        const double s = 1e-3 * i;
        tool.load_n = hal::Vector3{0.3, 0.0, -1.0} *
                      (1.2 * std::exp(-s / 0.06) * std::sin(2.0 * std::numbers::pi * swing_hz * s));
        if (is_met && i >= 100) tool.load_n.z += 1.0;
        tool.tick();
        if (i >= 20 && !(is_met && i >= 100)) {
          ASSERT_GT(tool.watch.unloaded_s(), Guard::kFreeAirS) << swing_hz << " Hz, " << i << " ms";
        }
        if (is_met && i >= 120) {
          ASSERT_LT(tool.watch.unloaded_s(), 0.004) << swing_hz << " Hz, " << i << " ms";
        }
      }
    }
  }
}

TEST(LoadWatch, WhatWasIsNoLoadOnceTheReadingPointsElsewhere) {
  Tool tool;
  tool.settle();
  tool.rest();
  for (int i = 0; i < 200; ++i) {
    tool.offset_mm.z -= 0.01;
    tool.load_n.z = 0.01 * i;
    tool.tick();
  }
  ASSERT_LT(tool.watch.unloaded_s(), 0.002);
  for (int i = 0; i < 10; ++i) {
    tool.offset_mm.z += 0.1;
    tool.load_n.z -= 0.2;
    tool.tick();
  }
  tool.load_n.z = -0.07;  // the mean over 12 ms is still above 0.05 N
  for (int i = 1; i <= 4; ++i) {
    tool.offset_mm.z += 0.1;
    tool.tick();
    EXPECT_GT(tool.watch.unloaded_s(), 0.9e-3 * i - 1e-3) << i;
  }
  EXPECT_GT(tool.watch.unloaded_s(), 2e-3);
}

// ---- the guard's bound ----

GuardLimits modulating() {
  GuardLimits limits;
  limits.max_force_n = 8.5;
  limits.max_force_rate_n_per_s = 1700.0;
  limits.max_power_w = 100.0;
  limits.loop_gap_ms = 0.0;  // the tool moves on between two looks of the guard
  limits.renders_real_object = true;
  limits.tool = {kMassG, {}, {}, false};
  return limits;
}

double size(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

TEST(FreeAir, APipelineThatWantsTheWorstGetsThreeTenthsOfANewton) {
  Tool tool;
  Guard guard(modulating(), 1000.0);
  const auto pass = [&](const hal::Vector3& wanted_n) {
    return size(guard.release(guard.admit(tool.sample), wanted_n, 0));
  };
  // Constant 8 N, waved: none before the zero is proven, then what may be read in free air.
  tool.wave();
  for (int i = 0; i < 3000; ++i) {
    tool.tick();
    ASSERT_LE(pass({0.0, 0.0, 8.0}), Guard::kFreeAirN + 1e-12) << i;
  }
  // In a contact nothing is held back; after it the last force and an integrator do not get on.
  for (const bool integrates : {false, true}) {
    tool.rest();
    for (int i = 0; i < 300; ++i) {
      tool.tick();
      pass({});
    }
    double wanted_n = 8.0;
    double largest_n = 0.0;
    double last_n = 0.0;
    for (int i = 0; i < 300; ++i) {
      tool.offset_mm.z -= 0.01;
      tool.load_n.z = 0.01 * i;
      tool.tick();
      const double force_n = pass({0.0, 0.0, wanted_n});
      ASSERT_LE(force_n, std::max(Guard::kFreeAirN, last_n + 1e-3 * Guard::kLoadRiseNPerS) + 1e-9)
          << "a load makes no step, " << i;
      last_n = force_n;
      largest_n = std::max(largest_n, force_n);
    }
    EXPECT_NEAR(largest_n, 8.0, 1e-9);
    for (int i = 0; i < 20; ++i) {
      tool.offset_mm.z += 0.15;
      tool.load_n.z = std::max(0.0, tool.load_n.z - 0.15);
      tool.tick();
      pass({0.0, 0.0, wanted_n});
    }
    tool.load_n = {};
    double before_n = 8.0;
    for (int i = 0; i < 500; ++i) {
      tool.tick();
      if (integrates) wanted_n += 0.1;
      const double force_n = pass({0.0, 0.0, wanted_n});
      ASSERT_LE(before_n - force_n, 1.0) << "it comes down over some ticks";
      before_n = force_n;
      if (i >= 20) {
        ASSERT_LE(force_n, Guard::kFreeAirN + 1e-12) << i << " ms after the contact";
      }
    }
    tool.settle();
  }
}

// What an arm shows that swings after a load ends neither the fall of the bound nor the next one's beginning.
TEST(FreeAir, TheBoundComesDownUntilALoadIsSure) {
  Tool tool;
  tool.settle();
  Guard guard(modulating(), 1000.0);
  const auto pass = [&] {
    tool.tick();
    return size(guard.release(guard.admit(tool.sample), {0.0, 0.0, 8.0}, 0));
  };
  tool.wave();
  for (int i = 0; i < 1000; ++i) pass();
  tool.rest();
  tool.load_n.z = 1.0;
  for (int i = 0; i < 200; ++i) {
    tool.offset_mm.z -= 0.01;
    tool.load_n.z += 0.01;
    pass();
  }
  ASSERT_NEAR(pass(), 8.0, 1e-9);
  const auto move = [&](double mm, double n) {
    tool.offset_mm.z += mm;
    tool.load_n.z = std::max(0.0, tool.load_n.z + n);
    return pass();
  };
  for (int i = 0; i < 10; ++i) move(0.15, -0.35);
  ASSERT_EQ(tool.load_n.z, 0.0);
  for (int i = 1; i <= 5; ++i) move(0.02, 0.0);
  for (int i = 6; i <= 16; ++i) {
    const double force_n = move(-0.02, 0.4);
    if (i >= 12) {
      EXPECT_LE(force_n, Guard::kFreeAirN + 1e-12) << i << " ms after the load";
    }
  }
  for (int i = 0; i < 60; ++i) move(-0.01, 0.01);
  EXPECT_NEAR(pass(), 8.0, 1e-9) << "a load that stays is one";
}

TEST(FreeAir, IsNoMatterOfAssistanceNorOfAWall) {
  Tool tool;
  tool.wave();
  GuardLimits wall = modulating();
  wall.renders_real_object = false;
  Guard of_wall(wall, 1000.0);
  Guard guard(modulating(), 1000.0);
  double wall_n = 0.0;
  double assisted_n = 0.0;
  for (int i = 0; i < 100; ++i) {
    tool.tick();
    wall_n = size(of_wall.release(of_wall.admit(tool.sample), {0.0, 0.0, 4.0}, 0));
    EXPECT_FALSE(of_wall.limited() & guard_limit::kFreeAir);
    assisted_n = size(guard.release(guard.admit(tool.sample), {0.0, 0.0, 8.0}, 0, {2.0, 0.0, 0.0}));
    EXPECT_TRUE(guard.limited() & guard_limit::kFreeAir);
  }
  EXPECT_NEAR(wall_n, 4.0, 1e-9);
  EXPECT_NEAR(assisted_n, 2.0, 0.05);
}

TEST(FreeAir, ASilentSensorIsNoFreeAirUntilItIsStale) {
  Tool tool;
  GuardLimits limits = modulating();
  limits.sensor_stale_after_ms = 20.0;
  Guard guard(limits, 1000.0);
  tool.wave();
  for (int i = 0; i < 1000; ++i) {
    tool.tick();
    (void)guard.release(guard.admit(tool.sample), {}, 0);
  }
  tool.rest();
  for (int i = 0; i < 300; ++i) {
    tool.offset_mm.z -= 0.01;
    tool.load_n.z = 0.01 * i;
    tool.tick();
    (void)guard.release(guard.admit(tool.sample), {0.0, 0.0, 5.0}, 0);
  }
  EXPECT_NEAR(size(guard.force_n()), 5.0, 1e-9);
  tool.sample.status = hal::sample_status::kForceMissing;
  for (int i = 0; i < 150; ++i) {
    tool.sample.time_ns += 1'000'000;
    tool.sample.force_age_ns += 1'000'000;
    (void)guard.release(guard.admit(tool.sample), {0.0, 0.0, 5.0}, 0);
    if (i == 15) {
      EXPECT_NEAR(size(guard.force_n()), 5.0, 1e-9) << "what is pressed is held";
    }
  }
  EXPECT_EQ(size(guard.force_n()), 0.0) << "by the limit of silence, whose ramp takes 0.1 s";
}

}  // namespace
}  // namespace hapticd::rt
