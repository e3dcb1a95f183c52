#include <gtest/gtest.h>

#include <cmath>

#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {
namespace {

constexpr double kRateHz = 1000.0;
constexpr std::int64_t kPeriodNs = 1'000'000;

TEST(MotionEstimator, AccelerationOfAParabolaIsFound) {
  MotionEstimator motion(0.001, kRateHz);
  for (int i = 0; i < 500; ++i) motion.update(0.5 * 2000.0 * i * i * 1e-6, i * kPeriodNs);
  EXPECT_NEAR(motion.acceleration_mm_per_s2(), 2000.0, 120.0) << "the window changes length now and then";
  EXPECT_NEAR(motion.velocity_mm_per_s(), 2000.0 * 0.499, 2000.0 * 0.008);
}

TEST(MotionEstimator, AGapIsNoJumpInVelocity) {
  MotionEstimator steady(0.03, kRateHz);
  double largest = 0.0;
  std::int64_t tick = 0;
  for (int i = 0; i < 300; ++i) {
    tick += i == 200 ? 6 : 1;  // five ticks never came
    steady.update(0.4 * static_cast<double>(tick), tick * kPeriodNs);
    if (i > 190) largest = std::max(largest, std::abs(steady.acceleration_mm_per_s2()));
  }
  EXPECT_NEAR(steady.velocity_mm_per_s(), 400.0, 1e-6);
  EXPECT_LT(largest, 1e-6);
}

TEST(MotionEstimator, ATickThatComesAlmostInTimeIsOneTick) {
  MotionEstimator steady(0.03, kRateHz);
  MotionEstimator jittery(0.03, kRateHz);
  for (int i = 0; i < 100; ++i) {
    const double position_mm = 0.01 * i * i;
    steady.update(position_mm, i * kPeriodNs);
    jittery.update(position_mm, i * kPeriodNs + (i % 2 == 0 ? 0 : kPeriodNs * 45 / 100));
    EXPECT_EQ(jittery.velocity_mm_per_s(), steady.velocity_mm_per_s()) << i;
    EXPECT_EQ(jittery.acceleration_mm_per_s2(), steady.acceleration_mm_per_s2()) << i;
  }
}

TEST(MotionEstimator, GapsAreRoundedToWholePeriods) {
  const auto moved_on = [](double periods) {
    MotionEstimator motion(0.03, kRateHz);
    for (int i = 0; i < 100; ++i) motion.update(0.3 * i, i * kPeriodNs);
    motion.update(0.3 * (99.0 + std::round(periods)),
                  99 * kPeriodNs + static_cast<std::int64_t>(periods * static_cast<double>(kPeriodNs)));
    return motion.velocity_mm_per_s();
  };
  for (const double periods : {0.6, 1.4, 1.5, 2.4, 2.6, 16.4})
    EXPECT_NEAR(moved_on(periods), 300.0, 1e-6) << periods;
  EXPECT_EQ(moved_on(16.6), 0.0) << "too long to be filled";
}

TEST(MotionEstimator, StartsAnewAfterALongGap) {
  MotionEstimator motion(0.03, kRateHz);
  for (int i = 0; i < 100; ++i) motion.update(0.3 * i, i * kPeriodNs);
  motion.update(500.0, 1'000'000'000);
  EXPECT_EQ(motion.velocity_mm_per_s(), 0.0);
  EXPECT_EQ(motion.acceleration_mm_per_s2(), 0.0);
}

TEST(MotionEstimator, TimeThatRunsBackwardsStartsAnewToo) {
  MotionEstimator motion(0.03, kRateHz);
  for (int i = 0; i < 100; ++i) motion.update(0.3 * i, i * kPeriodNs);
  motion.update(0.0, 0);
  EXPECT_EQ(motion.velocity_mm_per_s(), 0.0);
}

TEST(ToolCompensation, GramsTimesMillimetresGiveNewtons) {
  // 9.35 g at 1 g of acceleration weigh 91.7 mN.
  EXPECT_NEAR(inertial_force_n(9.35, 9807.0), 9.35e-3 * 9.807, 1e-12);
  // A free tool accelerated into the object reads its own inertia and nothing else.
  EXPECT_NEAR(reaction_force_n(9.35e-3 * 9.807, 9.35, 9807.0), 0.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::rt
