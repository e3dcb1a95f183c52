#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/unit/rt/scene/pipeline_bench.h"

namespace hapticd::rt {
namespace {

TEST(TapPipeline, GivesTheDifferenceBetweenObjectAndTarget) {
  Bench bench(rigid(0.7));
  const TickRecord record = bench.touch(6.0, 0.4, 2000);
  EXPECT_TRUE(record.in_contact);
  EXPECT_NEAR(record.displacement_mm, 6.0, 0.03);
  EXPECT_NEAR(record.reaction_force_n, 2.4, 0.01);
  EXPECT_NEAR(record.desired_force_n, (0.4 - 0.7) * 6.0, 0.03);
  EXPECT_NEAR(record.device_command_n.z, (0.7 - 0.4) * 6.0, 0.03) << "harder: the device pushes up";
}

const hal::DeviceInfo kStrong{"phantom_1_5_high_force", 37.5, 6.2, 0.03, 2.537, 150.0};

TEST(TapPipeline, PullsWithNoMoreThanLeavesTheHandItsShareOfTheSensor) {
  Bench bench(rigid(0.1), kStrong);
  bench.touch(3.0, 10.0, 2000);
  const TickRecord record = bench.press(3.0, 3.0, 10.0, 500);
  EXPECT_NEAR(record.reaction_force_n, 30.0, 0.01);
  EXPECT_NEAR(record.desired_force_n, 24.5, 1e-9) << "not 29.7 N: 0.7 of the sensor's 35 N";
  EXPECT_NEAR(record.device_command_n.z, -24.5, 1e-6);
  EXPECT_NEAR(record.hand_force_n, 5.5, 0.01);
  EXPECT_TRUE(record.guard_limits & guard_limit::kForce) << "and it is reported";
  EXPECT_NEAR(record.feasible_min_n_per_mm, 10.0 * 5.5 / (5.5 + 24.5), 0.05);
  // Against the hand it may do all it can.
  SceneSpec stiff = rigid(1.2);
  stiff.max_target_stiffness_n_per_mm = 1.2;
  Bench wall(stiff, kStrong);
  wall.touch(30.0, 0.15, 4000);
  EXPECT_GT(wall.press(30.0, 30.0, 0.15, 500).device_command_n.z, 30.0);
}

TEST(TapPipeline, AtItsLargestPullItStillKnowsWhereTheTipIs) {
  SceneSpec spec;
  spec.target.stiffness_n_per_mm = 0.1;
  Bench bench(spec, kStrong);
  bench.touch(0.5, 10.0, 2000);
  // The tip 3 mm deep under 30 N, the encoders ahead of it by what 24.5 N bend.
  hal::RigSample bent = bench.at_depth(3.0 + 24.5 / 2.537, 0.0);
  bent.sensor_force_n.z = 30.0;
  TickRecord record;
  const hal::Vector3 from_mm = bench.at_depth(0.5, 0.0).tip_position_mm;
  for (int i = 0; i < 2000; ++i) {  // pressed there, not put there
    const double share = std::min(1.0, i / 1500.0);
    hal::RigSample now = bench.at_depth(0.5, 0.0);
    now.tip_position_mm = from_mm + (bent.tip_position_mm - from_mm) * share;
    now.sensor_force_n.z = 5.0 + 25.0 * share;
    record = bench.tick(now);
  }
  ASSERT_TRUE(record.in_contact);
  EXPECT_NEAR(record.desired_force_n, 24.5, 1e-9);
  EXPECT_NEAR(record.displacement_mm, 3.0, 0.1);
}

TEST(TapPipeline, ContactPointIsFoundBehindTheTickThatDeclaresIt) {
  Bench bench(rigid(0.4));
  bench.press(-5.0, -5.0, 0.1, 50);
  TickRecord record;
  double declared_at = 0.0;
  for (double depth = -5.0; depth < 2.0; depth += 0.015) {  // 15 mm/s on 0.1 N/mm: 15 mN only at 0.15 mm
    record = bench.tick(bench.at_depth(depth, 0.1));
    if (record.contact_reason == ContactReason::kAboveThreshold) declared_at = depth;
  }
  EXPECT_GT(declared_at, 0.14);
  EXPECT_NEAR(record.displacement_mm, 1.99, 0.09) << "within the depth at which the force was still nothing";
}

TEST(TapPipeline, StaysSilentInFreeMotion) {
  Bench bench(rigid(0.7));
  const TickRecord record = bench.press(-60.0, -1.0, 0.4, 500);
  EXPECT_FALSE(record.in_contact);
  EXPECT_EQ(record.device_command_n.z, 0.0);
}

TEST(TapPipeline, LoadedUnderPressureWaitsForTheToolToComeFree) {
  Bench bench(rigid(0.7));
  TickRecord record = bench.press(5.0, 5.0, 0.4, 500);
  EXPECT_FALSE(record.in_contact);
  EXPECT_EQ(record.contact_reason, ContactReason::kAwaitingFree);
  EXPECT_EQ(record.device_command_n.z, 0.0) << "no jolt: where the surface is, no one knows yet";
  bench.press(5.0, -5.0, 0.4, 1000);
  bench.press(-5.0, -5.0, 0.4, 200);
  record = bench.press(-5.0, 3.0, 0.4, 1000);
  EXPECT_TRUE(record.in_contact);
}

TEST(TapPipeline, StoppedAndClearedItRendersAgainOnceTheToolWasFree) {
  Bench bench(rigid(0.7));
  bench.touch(5.0, 0.4);
  const double full = bench.press(5.0, 5.0, 0.4, 100).device_command_n.z;
  bench.renderer().raise(GuardFault::kStopped);
  EXPECT_EQ(bench.tick(bench.at_depth(5.0, 0.4)).device_command_n.z, 0.0);
  ASSERT_TRUE(bench.renderer().clear());
  // What was known of the contact is over with the cut: where the surface is, only a new contact shows.
  for (int i = 0; i < 600; ++i) {
    const TickRecord record = bench.tick(bench.at_depth(5.0, 0.4));
    ASSERT_EQ(record.device_command_n.z, 0.0) << "tick " << i;
    ASSERT_FALSE(record.in_contact);
  }
  EXPECT_EQ(bench.renderer().guard().state(), GuardState::kRendering);
  bench.press(5.0, -5.0, 0.4, 1000);
  bench.press(-5.0, 5.0, 0.4, 1000);
  EXPECT_NEAR(bench.press(5.0, 5.0, 0.4, 100).device_command_n.z, full, 0.01);
}

TEST(TapPipeline, AnObjectThatLetsGoWhileTheTipIsDeepCausesNoKnock) {
  Bench bench(rigid(0.7));
  bench.touch(5.0, 0.4);
  double before = bench.press(5.0, 5.0, 0.4, 200).device_command_n.z;
  EXPECT_NEAR(before, 1.5, 0.03);
  // The surface stays behind: no reaction any more, at 5 mm. What the target asks there is 3.5 N.
  double largest = 0.0;
  TickRecord record;
  for (int i = 0; i < 300; ++i) {
    record = bench.tick(bench.at_depth(5.0, 0.0));
    if (!record.in_contact) largest = std::max(largest, before - record.device_command_n.z);
    before = record.device_command_n.z;
  }
  EXPECT_FALSE(record.in_contact);
  EXPECT_NEAR(record.device_command_n.z, 0.0, 1e-6);
  EXPECT_LT(largest, 1.5 * 3.5 / 50.0) << "3.5 N over 50 ms";
}

TEST(TapPipeline, TargetChangesMoveTheForceNoFasterThanTheSceneSays) {
  SceneSpec spec = rigid(0.3);
  spec.max_target_change_n_per_s = 4.0;
  Bench bench(spec);
  bench.touch(5.0, 0.4);
  double before = bench.press(5.0, 5.0, 0.4, 100).device_command_n.z;
  bench.renderer().set_target(linear_target(0.7), 0.1);
  for (int i = 0; i < 600; ++i) {
    const double force = bench.tick(bench.at_depth(5.0, 0.4)).device_command_n.z;
    EXPECT_LE(std::abs(force - before), 1.01 * 4.0 / 1000.0) << i;
    before = force;
    if (i == 400) {
      EXPECT_LT(before, 1.3) << "not yet";
    }
  }
  EXPECT_NEAR(before, 0.3 * 5.0, 0.03) << "2 N in half a second";
}

TEST(TapPipeline, CompensatedDisplacementIsTheTipsNotTheEncoders) {
  SceneSpec spec;
  spec.target.stiffness_n_per_mm = 0.7;
  Bench bench(spec);
  const TickRecord record = bench.touch(5.0, 0.4, 2000);
  EXPECT_NEAR(record.displacement_mm, 5.0 - record.desired_force_n / 3.5, 0.05);
  EXPECT_GT(record.displacement_mm, 5.1) << "pushing back, the tip is deeper than the encoders say";
}

TEST(Renderer, WithoutASceneTheForceIsZeroAndOnlySampleAndGuardAreReported) {
  Bench bench(rigid(0.7));
  bench.renderer().exchange(nullptr, bench.scene().guard);
  const TickRecord record = bench.press(-5.0, 5.0, 0.4, 100);
  EXPECT_EQ(record.device_command_n.z, 0.0);
  EXPECT_EQ(record.channels, channel::kSample | channel::kGuard);
  EXPECT_EQ(record.scene_generation, 0U);
}

/// Any sequence of finite or non-finite samples gives finite commands inside the limits, and good samples
/// after a clear bring the rendering back.
TEST(Renderer, SurvivesAnySequenceOfSamples) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<int> dice(0, 19);
  std::normal_distribution<double> wild(0.0, 30.0);
  const auto value = [&](double usual) -> double {
    switch (dice(random)) {
      case 0:
        return std::numeric_limits<double>::quiet_NaN();
      case 1:
        return dice(random) < 10 ? HUGE_VAL : -HUGE_VAL;
      case 2:
        return 1e300;
      case 3:
        return wild(random);
      default:
        return usual;
    }
  };
  for (const SceneKind kind : {SceneKind::kTap1d, SceneKind::kWall}) {
    SceneSpec spec;
    spec.kind = kind;
    spec.target.stiffness_n_per_mm = 0.7;
    Bench bench(spec);
    for (int round = 0; round < 20; ++round) {
      for (int i = 0; i < 2000; ++i) {
        const double depth = 5.0 * std::sin(0.01 * i);
        hal::RigSample sample = bench.at_depth(depth, 0.4);
        if (dice(random) < 5) {
          sample.tip_position_mm.z = value(sample.tip_position_mm.z);
          sample.sensor_force_n.z = value(sample.sensor_force_n.z);
          sample.status = dice(random) == 0 ? 0xFU : 0U;
        }
        const TickRecord record = bench.tick(sample);
        const hal::Vector3& f = record.device_command_n;
        ASSERT_TRUE(std::isfinite(f.x) && std::isfinite(f.y) && std::isfinite(f.z));
        ASSERT_LE(std::sqrt(dot(f, f)), 8.5 + 1e-9);
        if (dice(random) == 0) bench.renderer().clear();
        if (dice(random) == 0) bench.renderer().set_target(linear_target(std::abs(wild(random))), 0.05);
      }
      // Good samples again: free and lifted once, which proves the zero, then pressing.
      bench.press(-5.0, -5.0, 0.4, 300);
      ASSERT_TRUE(bench.renderer().clear());
      bench.renderer().set_target(linear_target(0.7), 0.0);
      bench.press(-5.0, -25.0, 0.4, 600);
      bench.press(-25.0, -5.0, 0.4, 2000);
      const TickRecord back = bench.press(-5.0, 3.0, 0.4, 1000);
      ASSERT_TRUE(back.in_contact) << "round " << round;
      // The tap adds (0.7 - 0.4) N/mm, the wall all of its 0.7; both see through the bending structure.
      const double tip_mm = back.displacement_mm;
      ASSERT_NEAR(back.device_command_n.z, (kind == SceneKind::kTap1d ? 0.7 * tip_mm - 1.2 : 0.7 * tip_mm),
                  0.1);
    }
  }
}

TEST(Renderer, TenHoursAtRestInContactDoNotDrift) {
  Bench bench(rigid(0.7));
  bench.touch(5.0, 0.4);
  const double at_first = bench.press(5.0, 5.0, 0.4, 1000).device_command_n.z;
  // 36 million ticks are ten hours; after a million the same state repeats. Until then what the first
  // milliseconds of the touch taught of a drift is forgotten.
  TickRecord record;
  for (int i = 0; i < 1'000'000; ++i) record = bench.tick(bench.at_depth(5.0, 0.4));
  const double later = record.device_command_n.z;
  EXPECT_NEAR(later, at_first, 1e-3);
  for (int i = 0; i < 1'000'000; ++i) record = bench.tick(bench.at_depth(5.0, 0.4));
  EXPECT_NEAR(record.device_command_n.z, later, 1e-9);
}

}  // namespace
}  // namespace hapticd::rt
