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

TEST(MotionEstimator, LateTicksLeaveAnEvenMotionEven) {
  // One tick late by 0.1 ... 15 ms, those after it on time again.
  for (const double late_ms : {0.1, 0.3, 0.95, 1.7, 5.0, 14.9}) {
    MotionEstimator motion(0.03, kRateHz);
    double largest = 0.0;
    for (int i = 0; i < 300; ++i) {
      const auto late_ns = static_cast<std::int64_t>(1e6 * late_ms);
      const std::int64_t due_ns = i * kPeriodNs + (i > 200 ? late_ns / kPeriodNs * kPeriodNs : 0);
      const std::int64_t time_ns = due_ns + (i == 200 ? late_ns : 0);
      if (i > 200 && time_ns <= 200 * kPeriodNs + late_ns) continue;
      motion.update(150e-9 * static_cast<double>(time_ns), time_ns);
      if (i > 100) largest = std::max(largest, std::abs(motion.velocity_mm_per_s() - 150.0));
      if (i > 100) largest = std::max(largest, std::abs(motion.acceleration_mm_per_s2()));
    }
    EXPECT_LT(largest, 1e-4) << late_ms;
  }
}

TEST(MotionEstimator, TheAccelerationOfAWaveIsTheSameWithIrregularTicks) {
  // A hand's wave, +-20 mm at 2.2 Hz, read without rounding: what differs is the ticks alone.
  const auto wave_mm = [](std::int64_t ns) {
    return 20.0 * std::sin(2.0 * M_PI * 2.2e-9 * static_cast<double>(ns));
  };
  MotionEstimator regular(0.03, kRateHz);
  MotionEstimator irregular(0.03, kRateHz);
  double largest = 0.0;
  std::uint64_t state = 7;
  for (int i = 0; i < 3000; ++i) {
    regular.update(wave_mm(i * kPeriodNs), i * kPeriodNs);
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    const auto late_ns = static_cast<std::int64_t>(0.8e6 * static_cast<double>(state >> 40) / (1 << 24));
    irregular.update(wave_mm(i * kPeriodNs + late_ns), i * kPeriodNs + late_ns);
    if (i < 200) continue;
    largest =
        std::max(largest, std::abs(regular.acceleration_mm_per_s2() - irregular.acceleration_mm_per_s2()));
  }
  EXPECT_LT(largest, 760.0) << "a fifth of 3800: the window changes length at other moments";
}

TEST(MotionEstimator, AReadingAlmostAtOnceShowsNoMotion) {
  MotionEstimator motion(0.03, kRateHz);
  for (int i = 0; i < 100; ++i) motion.update(0.15 * i, i * kPeriodNs);
  for (const std::int64_t after_ns : {0, 10'000, 40'000}) {
    motion.update(0.15 * 99.0 + 0.03, 99 * kPeriodNs + after_ns);
    EXPECT_NEAR(motion.velocity_mm_per_s(), 150.0, 1e-6);
  }
  motion.update(15.0, 100 * kPeriodNs);
  EXPECT_NEAR(motion.velocity_mm_per_s(), 150.0, 1e-6) << "the next one is measured from the last used";
}

TEST(MotionEstimator, ItsStartIsNoAcceleration) {
  MotionEstimator motion(0.03, kRateHz);
  for (int i = 0; i < 100; ++i) {
    motion.update(0.15 * i, i * kPeriodNs);
    EXPECT_NEAR(motion.acceleration_mm_per_s2(), 0.0, 1e-6) << i;
  }
}

TEST(MotionEstimator, StartsAfreshAfterALongGapAndWhereTimeRunsBackwards) {
  for (const std::int64_t time_ns : {1'000'000'000, 0}) {
    MotionEstimator motion(0.03, kRateHz);
    for (int i = 0; i < 100; ++i) motion.update(0.3 * i, i * kPeriodNs);
    motion.update(500.0, time_ns);
    EXPECT_EQ(motion.velocity_mm_per_s(), 0.0);
    EXPECT_EQ(motion.acceleration_mm_per_s2(), 0.0);
  }
}

TEST(ToolCompensation, GramsTimesMillimetresGiveNewtons) {
  // 9.35 g at 1 g of acceleration weigh 91.7 mN.
  EXPECT_NEAR(inertial_force_n(9.35, 9807.0), 9.35e-3 * 9.807, 1e-12);
  // A free tool accelerated into the object reads its own inertia and nothing else.
  EXPECT_NEAR(reaction_force_n(9.35e-3 * 9.807, 9.35, 9807.0), 0.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::rt
