// The noise source: repeatable and normal.

#include "hal/sim/base/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::sim {
namespace {

TEST(Random, UniformFillsTheUnitInterval) {
  Random random(3);
  constexpr int kDraws = 200'000;
  double sum = 0.0, low = 1.0, high = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    sum += u;
    low = std::min(low, u);
    high = std::max(high, u);
  }
  EXPECT_GE(low, 0.0);
  EXPECT_LT(high, 1.0);
  EXPECT_NEAR(sum / kDraws, 0.5, 5.0 / std::sqrt(12.0 * kDraws));
}

TEST(Random, NormalHasTheMomentsOfANormal) {
  Random random(4);
  constexpr int kDraws = 400'000;
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0, lag = 0.0, previous = 0.0;
  int beyond_two = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double z = random.normal();
    m1 += z;
    m2 += z * z;
    m3 += z * z * z;
    m4 += z * z * z * z;
    lag += z * previous;
    previous = z;
    beyond_two += std::abs(z) > 2.0 ? 1 : 0;
  }
  // Five standard errors each: variances of the sample moments of a standard normal are 1, 2, 15, 96.
  const double error = 5.0 / std::sqrt(kDraws);
  EXPECT_NEAR(m1 / kDraws, 0.0, error);
  EXPECT_NEAR(m2 / kDraws, 1.0, error * std::sqrt(2.0));
  EXPECT_NEAR(m3 / kDraws, 0.0, error * std::sqrt(15.0));
  EXPECT_NEAR(m4 / kDraws, 3.0, error * std::sqrt(96.0));
  EXPECT_NEAR(lag / kDraws, 0.0, error);
  EXPECT_NEAR(1.0 * beyond_two / kDraws, std::erfc(std::sqrt(2.0)), error * 0.21);
}

}  // namespace
}  // namespace hapticd::sim
