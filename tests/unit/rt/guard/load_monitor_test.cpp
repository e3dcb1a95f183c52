#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/guard/guard.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"
#include "tests/unit/rt/guard/watched_tool.h"

namespace hapticd::rt {
namespace {

using test::WatchedTool;

TEST(LoadMonitor, ABiasIsProvenByMotionInFreeAirAndNotByRest) {
  WatchedTool tool;
  tool.run(2.0);
  EXPECT_TRUE(tool.watch.is_waiting());
  EXPECT_FALSE(tool.watch.has_jumped());
  tool.wave();
  tool.run(0.5);
  EXPECT_FALSE(tool.watch.is_waiting());
  EXPECT_LT(norm(tool.watch.jump_n()), 0.02);
}

/// A stretch that a noisy reading begins has no direction: with some seeds 9 mm of approach proved nothing.
TEST(LoadMonitor, ANoisySensorsZeroIsProvenByTheApproach) {
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    WatchedTool tool(1000.0, seed);
    tool.noise_n = 0.010;
    tool.run(2.0);
    for (int i = 0; i < 300; ++i) {
      tool.offset_mm.z -= 0.03;
      tool.tick();
    }
    EXPECT_FALSE(tool.watch.is_waiting()) << seed;
    EXPECT_EQ(tool.watch.jump_count(), 0U) << seed;
    tool.press();
    EXPECT_LT(tool.watch.unloaded_s(), 0.005) << seed;
  }
}

TEST(LoadMonitor, WavedInFreeAirItShowsNoLoad) {
  for (const double rate_hz : {500.0, 1000.0, 5000.0}) {
    WatchedTool tool(rate_hz);
    tool.settle();
    for (int i = 0; i < static_cast<int>(5.0 * rate_hz); ++i) {
      tool.tick();
      ASSERT_GT(tool.watch.unloaded_s(), 0.02) << rate_hz << " Hz, " << tool.time_s;
      ASSERT_FALSE(tool.watch.is_waiting());
    }
    EXPECT_EQ(tool.watch.jump_count(), 0U);
  }
}

TEST(LoadMonitor, TheToolsWeightIsNoLoadInAnyOrientation) {
  WatchedTool tool = test::tool_at_rest();
  for (int i = 0; i < 6000; ++i) {
    const double half = 0.5 * 3.0 * 1e-3 * i / 6.0;
    tool.sample.tip_orientation = {std::cos(half), std::sin(half), 0.0, 0.0};
    const hal::Vector3 weight{0.0, 0.0, -inertial_force_n(WatchedTool::kMassG, 9807.0)};
    tool.zero_n = rotated(conjugate(tool.sample.tip_orientation), weight) - weight;
    tool.tick();
    ASSERT_GT(tool.watch.unloaded_s(), 0.02) << i;
  }
}

/// A spring of this stiffness that is met along -z at this speed.
void meet(WatchedTool& tool, double n_per_mm, double mm_per_s, double depth_mm) {
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

TEST(LoadMonitor, AnObjectIsALoadHowSoftOrHardAndFastItIsMet) {
  for (const double n_per_mm : {0.05, 0.3, 2.0, 10.0}) {
    for (const double mm_per_s : {5.0, 50.0, 300.0}) {
      WatchedTool tool = test::tool_at_rest();
      tool.run(0.2);
      meet(tool, n_per_mm, mm_per_s, std::min(10.0, 4.0 / n_per_mm));
    }
  }
}

/// Whether a load is seen while a tool is pulled off an object, with 100 mm/s and then by 25 m/s², its
/// inertia alone. `exchanged`: meanwhile the scene is exchanged for one that says something else of the same
/// tool.
bool is_load_seen_when_pulled_off(bool exchanged) {
  WatchedTool tool = test::pressed_tool();
  for (int i = 1; i <= 20; ++i) {
    tool.offset_mm.z += 0.1;
    tool.load_n.z = 2.0 - 0.1 * i;
    tool.tick();
  }
  constexpr double kMmPerS2 = 25e3;
  tool.load_n.z = -inertial_force_n(WatchedTool::kMassG, kMmPerS2);
  bool is_seen = false;
  for (int i = 1; i <= 25; ++i) {
    tool.offset_mm.z += 0.1 + kMmPerS2 * (i - 0.5) * 1e-6;
    if (exchanged && i == 8)
      tool.watch.set_parameters({WatchedTool::kMassG, {}, {0.0, 0.0, -0.1}, true, 3.0});
    tool.tick();
    is_seen = is_seen || (i > 3 && tool.watch.unloaded_s() == 0.0);
  }
  return is_seen;
}

TEST(LoadMonitor, AnotherSceneWithTheSameToolForgetsNothing) {
  EXPECT_FALSE(is_load_seen_when_pulled_off(false));
  EXPECT_FALSE(is_load_seen_when_pulled_off(true));
}

/// Way into a spring of 0.3 N/mm until the load counts, mm. `shaken`: while an object was held before, some
/// seconds ago, the tip was moved back and forth faster than any hand can.
double way_until_load_mm(bool shaken) {
  WatchedTool tool = test::pressed_tool();
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

TEST(LoadMonitor, WhatShookTheToolIsForgottenWhileItIsFree) {
  const double untouched_mm = way_until_load_mm(false);
  EXPECT_LT(untouched_mm, 0.6);
  EXPECT_NEAR(way_until_load_mm(true), untouched_mm, 0.1);
}

/// Pressed onto a spring that bears little of what is felt: the reading relaxes from 70 to 42 mN while the
/// tip rests.
void press_what_bears_little(WatchedTool& tool) {
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

TEST(LoadMonitor, WhatIsLeftOfALoadIsHeldWhileTheTipRests) {
  WatchedTool tool = test::tool_at_rest();
  tool.run(0.2);
  press_what_bears_little(tool);
  // Gone, but for a zero that drifted meanwhile.
  tool.load_n.z = 0.02;
  tool.run(0.03);
  EXPECT_GT(tool.watch.unloaded_s(), 0.014);
}

TEST(LoadMonitor, WhatIsLeftOfALoadIsNoneOnceTheTipHasLeft) {
  WatchedTool tool = test::tool_at_rest();
  tool.run(0.2);
  press_what_bears_little(tool);
  for (int i = 0; i < 30; ++i) {
    tool.offset_mm.z += 0.05;
    tool.tick();
  }
  EXPECT_GT(tool.watch.unloaded_s(), 0.014);
}

TEST(LoadMonitor, AZeroThatDriftsIsFollowed) {
  WatchedTool tool = test::tool_at_rest();
  for (int i = 0; i < 60'000; ++i) {
    tool.zero_n = {5e-6 * i, -5e-6 * i, 2e-6 * i};
    tool.tick();
    ASSERT_GT(tool.watch.unloaded_s(), 0.02) << i;
  }
  EXPECT_EQ(tool.watch.jump_count(), 0U);
}

TEST(LoadMonitor, AnArmThatSwingsShowsNoLoadAndAnObjectThatIsMetMeanwhileDoes) {
  for (const double swing_hz : {35.0, 60.0, 120.0}) {
    for (const bool is_met : {false, true}) {
      WatchedTool tool;
      tool.watch.set_parameters({WatchedTool::kMassG, {}, {}, false, 0.0, 0.4});
      tool.settle();
      tool.rest();
      tool.load_n.z = 10.0;
      tool.run(0.5);
      for (int i = 0; i < 200; ++i) {
        const double s = 1e-3 * i;
        tool.load_n = hal::Vector3{0.3, 0.0, -1.0} *
                      (1.2 * std::exp(-s / 0.06) * std::sin(2.0 * std::numbers::pi * swing_hz * s));
        // Within some milliseconds, as a reaction grows: in one it would be a jump.
        if (is_met && i >= 100) tool.load_n.z += std::min(1.0, 0.2 * (i - 99));
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

TEST(LoadMonitor, WhatWasIsNoLoadOnceTheReadingPointsElsewhere) {
  WatchedTool tool = test::tool_at_rest();
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

}  // namespace
}  // namespace hapticd::rt
