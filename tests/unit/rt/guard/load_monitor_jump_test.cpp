#include <gtest/gtest.h>

#include <algorithm>

#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"
#include "tests/unit/rt/guard/watched_tool.h"

namespace hapticd::rt {
namespace {

using test::WatchedTool;

TEST(LoadMonitor, WavedWithALateClockTheToolsInertiaIsNoJump) {
  for (const double late_s : {0.3e-3, 0.9e-3}) {
    WatchedTool tool;
    tool.settle();
    tool.late_s = late_s;
    tool.run(30.0);
    EXPECT_EQ(tool.watch.jump_count(), 0U) << late_s;
    EXPECT_LT(norm(tool.watch.jump_n()), 0.02) << late_s;
  }
}

TEST(LoadMonitor, AJumpOfAnySizeAndAxisIsNoLoadForLongAndIsTakenOver) {
  for (const bool waved : {false, true}) {
    for (const double size_n : {0.1, 0.15, 0.3, 1.0, 3.0}) {
      for (const hal::Vector3& axis : WatchedTool::kAxes) {
        WatchedTool tool;
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

TEST(LoadMonitor, AKnockOnWhatIsHeldTakesNothingAway) {
  for (const double knock_n : {-1.0, 0.3, 1.0, 3.0}) {
    WatchedTool tool = test::pressed_tool();
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
TEST(LoadMonitor, AnObjectThatIsMovedUnderThePressIsNoJumpOnceTheToolIsThrown) {
  constexpr double kMmPerS2 = 40e3;
  for (const bool is_read : {true, false}) {
    WatchedTool tool = test::pressed_tool();
    tool.load_n.z -= 0.4;
    tool.run(0.2);
    for (int i = 1; i <= 20; ++i) {
      tool.offset_mm.z += 0.1;
      tool.load_n.z -= 0.08;
      tool.tick();
    }
    tool.load_n.z = is_read ? -inertial_force_n(WatchedTool::kMassG, kMmPerS2) : 0.1;
    for (int i = 1; i <= 30; ++i) {
      tool.offset_mm.z += (is_read ? kMmPerS2 : -kMmPerS2) * (i - 0.5) * 1e-6;
      tool.tick();
      ASSERT_EQ(tool.watch.jump_count(), 0U) << is_read << ", " << i << " ms after the object was left";
    }
  }
}

TEST(LoadMonitor, AJumpUnderAPressCountsOnceTheObjectIsLeft) {
  for (const double jump_n : {0.2, 0.5, -0.5, 2.0}) {
    for (const double mm_per_s : {1.0, 2.0, 20.0, 100.0}) {
      WatchedTool tool = test::pressed_tool();
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

TEST(LoadMonitor, ALateTickHidesNoJumpUnderAPress) {
  for (int after = 0; after < 47; after += 3) {  // where the late tick falls
    WatchedTool tool = test::tool_at_rest();
    tool.late_s = 0.3e-3;
    tool.press();
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

// When a stiff object is struck, the reading steps as it does when the zero jumps. How it grows afterwards
// shows which of them it was, but the zero stays wrong by the step until free air shows it.
TEST(LoadMonitor, TheZeroBeforeAJumpStaysNothingUntilTheNewOneIsProven) {
  WatchedTool tool = test::tool_at_rest();
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

// The reading moves by some 30 mN with the tool's mass, so it does not stay what it is for long.
TEST(LoadMonitor, WhatWasLeftByAZeroThatJumpedBackStaysLeft) {
  WatchedTool tool;
  tool.settle();
  tool.rest();
  tool.load_n.z = 0.3;
  tool.run(0.03);
  for (int i = 0; i < 400 && tool.watch.is_waiting(); ++i) {
    tool.offset_mm.z -= 0.02;
    tool.load_n.z += 0.02;
    tool.tick();
  }
  ASSERT_FALSE(tool.watch.is_waiting());
  tool.load_n = {};
  tool.run(0.02);
  int left_ticks = 0;
  for (int i = 0; i < 100; ++i) {
    tool.offset_mm.z += 0.02;
    tool.load_n.x = i < 50 ? 0.0 : 0.035 * (i % 20 < 10);
    tool.tick();
    left_ticks += tool.watch.is_left() ? 1 : 0;
    if (i > 50) {
      ASSERT_TRUE(tool.watch.is_left()) << i;
    }
  }
  EXPECT_GT(left_ticks, 60);
}

TEST(LoadMonitor, ALittleThatStaysInMotionIsDoubtedOnceTheZeroHasJumped) {
  for (const bool jumps : {false, true}) {
    WatchedTool tool;
    tool.settle();
    if (jumps) tool.zero_n.y = 0.2;
    tool.run(1.0);
    tool.rest();
    ASSERT_EQ(tool.watch.jump_count(), jumps ? 1U : 0U);
    ASSERT_FALSE(tool.watch.is_left());
    tool.press();
    for (const double zero_n : {0.05, 0.1}) {  // too little to be seen under a load
      tool.zero_n.x = zero_n;
      tool.run(0.2);
    }
    const auto move = [&](int ticks, double mm, double n) {
      for (int i = 0; i < ticks; ++i) {
        tool.offset_mm.z += mm;
        tool.load_n.z = std::max(0.0, tool.load_n.z + n);
        tool.tick();
      }
    };
    move(400, 0.01, -0.005);
    EXPECT_FALSE(tool.watch.is_left());
    move(200, 0.03, 0.0);
    EXPECT_EQ(tool.watch.is_left(), jumps) << "6 mm from the object";
    EXPECT_EQ(tool.watch.is_unsure(), jumps) << "and it is said";
    tool.zero_n.x = 0.07;
    tool.run(0.2);
    EXPECT_EQ(tool.watch.is_left(), jumps) << "at rest, and the zero has jumped again";
    move(100, -0.01, 0.005);
    EXPECT_FALSE(tool.watch.is_left()) << "on an object";
  }
}

TEST(LoadMonitor, TheZeroIsUnsureAfterTwoStepsUnderAPressUntilTheToolIsFree) {
  WatchedTool tool;
  tool.settle();
  tool.rest();
  tool.press();
  tool.zero_n.x = 0.4;
  tool.run(0.3);
  EXPECT_FALSE(tool.watch.is_unsure()) << "one may be a knock";
  tool.zero_n.x = 0.0;
  tool.run(0.3);
  EXPECT_TRUE(tool.watch.is_unsure());
  for (int i = 0; i < 400; ++i) {
    tool.offset_mm.z += 0.01;
    tool.load_n.z = std::max(0.0, tool.load_n.z - 0.005);
    tool.tick();
  }
  tool.run(1.0);
  EXPECT_TRUE(tool.watch.is_unsure()) << "at rest a load may hide behind a jump";
  for (int i = 0; i < 400; ++i) {
    tool.offset_mm.z += 0.01;
    tool.tick();
  }
  EXPECT_FALSE(tool.watch.is_unsure()) << "moved by 4 mm in free air";
}

TEST(LoadMonitor, AKnockIsNoDoubt) {
  WatchedTool tool;
  tool.settle();
  tool.rest();
  tool.press();
  for (int i = 0; i < 4; ++i) {
    tool.load_n.x = 0.5;
    tool.run(0.05);
    tool.load_n.x = 0.0;
    tool.run(0.4);
    EXPECT_FALSE(tool.watch.is_unsure()) << i;
  }
}

TEST(LoadMonitor, WhatWasBiasedAwayUnderAPressIsTakenOverOnceItIsSeenInFreeAir) {
  for (const double press_n : {0.1, 0.4, 1.0, 3.0}) {
    WatchedTool tool = test::tool_at_rest();
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

TEST(LoadMonitor, ALoadThatVanishesIsNoJump) {
  WatchedTool tool = test::tool_at_rest();
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

TEST(LoadMonitor, AStepAcrossALoadThatChangesIsNotedAsWell) {
  WatchedTool tool = test::pressed_tool();
  for (int i = 0; i < 300; ++i) {  // it lets go by 25 N/s
    tool.offset_mm.z += 0.02;
    tool.load_n.z = std::max(0.0, tool.load_n.z - 0.025);
    if (i == 40) tool.zero_n.x = -0.3;
    tool.tick();
  }
  EXPECT_EQ(tool.watch.jump_count(), 1U);
  EXPECT_LT(norm(tool.watch.jump_n() - tool.zero_n), 0.03);
}

}  // namespace
}  // namespace hapticd::rt
