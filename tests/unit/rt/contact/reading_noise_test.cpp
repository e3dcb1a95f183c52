#include "rt/contact/reading_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace hapticd::rt {
namespace {

const TickInterval kTick{1e-3, 1.0, 1.0, false};

/// Readings of a tool that a hand waves, for ten seconds.
BasicReadingNoise<double> after(double noise_n, double waved_n = 0.0) {
  BasicReadingNoise<double> noise;
  std::mt19937 random{3};
  std::normal_distribution<double> normal{0.0, 1.0};
  for (int i = 0; i < 10'000; ++i) {
    noise.update(waved_n * std::sin(0.08 * i) + noise_n * normal(random), kTick);
  }
  return noise;
}

TEST(ReadingNoise, OfAUsualSensorRaisesNothing) {
  EXPECT_EQ(after(0.0).excess_n(), 0.0);
  EXPECT_EQ(after(0.003).excess_n(), 0.0);
  EXPECT_EQ(after(0.003, 0.5).excess_n(), 0.0) << "what a hand does is not noise";
}

TEST(ReadingNoise, IsFollowedAndNamedIfItIsTooMuch) {
  EXPECT_NEAR(after(0.010).excess_n(), 0.006, 0.001);
  EXPECT_NEAR(after(0.010, 0.5).excess_n(), 0.006, 0.001);
  EXPECT_FALSE(after(0.018).is_too_much());
  EXPECT_TRUE(after(0.040).is_too_much());
}

TEST(ReadingNoise, AJumpOrNotANumberIsNone) {
  BasicReadingNoise<double> noise;
  double zero_n = 0.0;
  for (int i = 0; i < 5'000; ++i) {
    if (i % 1'000 == 0) zero_n += 1.0;
    noise.update(i == 2'500 ? std::numeric_limits<double>::quiet_NaN() : zero_n, kTick);
    ASSERT_EQ(noise.excess_n(), 0.0) << i;
  }
}

}  // namespace
}  // namespace hapticd::rt
