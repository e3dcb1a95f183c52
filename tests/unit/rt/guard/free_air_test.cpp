#include <gtest/gtest.h>

#include <algorithm>

#include "rt/guard/guard.h"
#include "rt/signal/vector.h"
#include "tests/unit/rt/guard/watched_tool.h"

namespace hapticd::rt {
namespace {

using test::WatchedTool;

GuardLimits modulating() {
  GuardLimits limits;
  limits.max_force_n = 8.5;
  limits.max_force_rate_n_per_s = 1700.0;
  limits.max_power_w = 100.0;
  limits.loop_gap_ms = 0.0;  // the tool moves on between two looks of the guard
  limits.renders_real_object = true;
  limits.tool = {WatchedTool::kMassG, {}, {}, false};
  return limits;
}

TEST(FreeAir, APipelineThatWantsTheWorstGetsThreeTenthsOfANewton) {
  WatchedTool tool;
  Guard guard(modulating(), 1000.0);
  const auto pass = [&](const hal::Vector3& wanted_n) {
    return norm(guard.release(guard.admit(tool.sample), wanted_n, 0));
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

// An arm that swings after a load shows loads, too. They neither end the fall of the bound nor keep the next
// from beginning.
TEST(FreeAir, TheBoundComesDownUntilALoadIsSure) {
  WatchedTool tool;
  tool.settle();
  Guard guard(modulating(), 1000.0);
  const auto pass = [&] {
    tool.tick();
    return norm(guard.release(guard.admit(tool.sample), {0.0, 0.0, 8.0}, 0));
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

TEST(FreeAir, ForceEndsWithoutAStepWhileTheZeroIsUnsure) {
  WatchedTool tool;
  tool.settle();
  tool.rest();
  Guard guard(modulating(), 1000.0);
  double last_n = 0.0;
  const auto pass = [&](int ticks, double mm, double n) {
    for (int i = 0; i < ticks; ++i) {
      tool.offset_mm.z += mm;
      tool.load_n.z = std::max(0.0, tool.load_n.z + n);
      tool.tick();
      const double force_n = norm(guard.release(guard.admit(tool.sample), {0.0, 0.0, 3.0}, 0));
      EXPECT_LE(last_n - force_n, 0.15);
      last_n = force_n;
    }
    return last_n;
  };
  tool.wave();
  pass(1000, 0.0, 0.0);
  tool.rest();
  pass(400, -0.01, 0.005);
  EXPECT_NEAR(pass(200, 0.0, 0.0), 3.0, 1e-9);
  tool.zero_n.x = 0.4;
  EXPECT_NEAR(pass(200, 0.0, 0.0), 3.0, 1e-9);
  tool.zero_n.y = 0.4;
  EXPECT_LT(pass(300, 0.0, 0.0), 1e-3);
  TickRecord record;
  guard.fill_record(record);
  EXPECT_TRUE(record.faults_present & set_of(GuardFault::kSensorJumped)) << "silence is reported";
}

TEST(FreeAir, IsNoMatterOfAssistanceNorOfAWall) {
  WatchedTool tool;
  tool.wave();
  GuardLimits wall = modulating();
  wall.renders_real_object = false;
  Guard of_wall(wall, 1000.0);
  Guard guard(modulating(), 1000.0);
  double wall_n = 0.0;
  double assisted_n = 0.0;
  for (int i = 0; i < 100; ++i) {
    tool.tick();
    wall_n = norm(of_wall.release(of_wall.admit(tool.sample), {0.0, 0.0, 4.0}, 0));
    EXPECT_FALSE(of_wall.limited() & guard_limit::kFreeAir);
    assisted_n = norm(guard.release(guard.admit(tool.sample), {0.0, 0.0, 8.0}, 0, {2.0, 0.0, 0.0}));
    EXPECT_TRUE(guard.limited() & guard_limit::kFreeAir);
  }
  EXPECT_NEAR(wall_n, 4.0, 1e-9);
  EXPECT_NEAR(assisted_n, 2.0, 0.05);
}

TEST(FreeAir, ASilentSensorIsNoFreeAirUntilItIsStale) {
  WatchedTool tool;
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
  EXPECT_NEAR(norm(guard.force_n()), 5.0, 1e-9);
  tool.sample.status = hal::sample_status::kForceMissing;
  for (int i = 0; i < 150; ++i) {
    tool.sample.time_ns += 1'000'000;
    tool.sample.force_age_ns += 1'000'000;
    (void)guard.release(guard.admit(tool.sample), {0.0, 0.0, 5.0}, 0);
    if (i == 15) {
      EXPECT_NEAR(norm(guard.force_n()), 5.0, 1e-9) << "what is pressed is held";
    }
  }
  EXPECT_EQ(norm(guard.force_n()), 0.0) << "by the limit of silence, whose ramp takes 0.1 s";
}

}  // namespace
}  // namespace hapticd::rt
