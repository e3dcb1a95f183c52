#include "rt/signal/reading_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace hapticd::rt {
namespace {

/// Readings of a tool that a hand waves, for ten seconds.
BasicReadingNoise<double> after(double noise_n, double waved_n = 0.0) {
  BasicReadingNoise<double> noise;
  std::mt19937 random{3};
  std::normal_distribution<double> normal{0.0, 1.0};
  for (int i = 0; i < 10'000; ++i) {
    noise.update(waved_n * std::sin(0.08 * i) + noise_n * normal(random), std::int64_t{1'000'000} * i);
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
  EXPECT_FALSE(after(0.015).is_too_much());
  EXPECT_TRUE(after(0.020).is_too_much());
}

TEST(ReadingNoise, AJumpOrNotANumberIsNone) {
  BasicReadingNoise<double> noise;
  double zero_n = 0.0;
  for (int i = 0; i < 5'000; ++i) {
    if (i % 1'000 == 0) zero_n += 1.0;
    noise.update(i == 2'500 ? std::numeric_limits<double>::quiet_NaN() : zero_n, std::int64_t{1'000'000} * i);
    ASSERT_EQ(noise.excess_n(), 0.0) << i;
  }
}

/// Records in bunches: a tick in ten comes late, with a wave on the reading that an even clock takes for
/// none.
TEST(ReadingNoise, ALateReadingIsNone) {
  BasicReadingNoise<double> noise;
  std::int64_t now_ns = 0;
  for (int i = 0; i < 5'000; ++i) {
    now_ns += i % 10 == 0 ? 8'000'000 : 1'000'000;
    noise.update(0.5 * std::sin(14.0e-9 * static_cast<double>(now_ns)), now_ns);
    ASSERT_EQ(noise.excess_n(), 0.0) << i;
  }
}

TEST(ReadingNoise, IsThatOfAMillisecondAtAnyRate) {
  BasicReadingNoise<double> noise;
  std::mt19937 random{5};
  std::normal_distribution<double> normal{0.0, 0.0063};  // of a sensor whose mean over a millisecond has 2 mN
  for (int i = 0; i < 50'000; ++i) noise.update(normal(random), std::int64_t{100'000} * i);
  EXPECT_EQ(noise.excess_n(), 0.0);
}

}  // namespace
}  // namespace hapticd::rt
