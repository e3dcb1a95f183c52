#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "rt/signal/adaptive_window_velocity.h"

namespace hapticd::rt {
namespace {

constexpr double kSamplingHz = 1000.0;

/// The definition, word for word, quadratic in the window: the implementation's interval intersection must
/// agree.
double by_definition(const std::vector<double>& y, double d) {
  const std::size_t k = y.size() - 1;
  double velocity = 0.0;
  for (std::size_t n = 1; n <= 15 && n <= k; ++n) {
    const double slope = (y[k] - y[k - n]) / static_cast<double>(n);
    for (std::size_t j = 1; j <= n; ++j) {
      if (std::abs(y[k - j] - (y[k] - slope * static_cast<double>(j))) > d + 1e-12) return velocity;
    }
    velocity = slope * kSamplingHz;
  }
  return velocity;
}

double quantised(double position, double step) {
  return std::round(position / step) * step;
}

TEST(AdaptiveWindowVelocity, IntervalIntersectionFollowsTheDefinition) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.02);
  AdaptiveWindowVelocity velocity(0.03, kSamplingHz);
  std::vector<double> history;
  for (int i = 0; i < 5000; ++i) {
    const double t = i / kSamplingHz;
    history.push_back(quantised(8.0 * std::sin(12.0 * t) + 0.5 * std::sin(90.0 * t) + noise(random),
                                0.0137));  // no multiple of the bound: no ties
    ASSERT_NEAR(velocity.update(history.back()), by_definition(history, 0.03), 1e-6) << "tick " << i;
  }
}

/// Slopes over measured times, point by point, each compared with all that is known before it.
double scanned(const std::vector<double>& t, const std::vector<double>& y, std::size_t spacing, double d) {
  const std::size_t k = y.size() - 1;
  double low = -HUGE_VAL, high = HUGE_VAL, slope = 0.0;
  for (std::size_t n = 1; n <= 15 && n * spacing <= k; ++n) {
    const double inverse = 1.0 / (t[k] - t[k - n * spacing]);
    const double candidate = (y[k] - y[k - n * spacing]) * inverse;
    if (candidate < low || candidate > high) break;
    slope = candidate;
    low = std::max(low, candidate - d * inverse);
    high = std::min(high, candidate + d * inverse);
  }
  return slope;
}

TEST(AdaptiveWindowVelocity, IsThatOfEachAxisHoweverTheTicksFall) {
  constexpr double kStepMm = 0.03;
  for (const double rate_hz : {1000.0, 5000.0}) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> periods(0.7, 1.4);
    AdaptiveWindowVelocity3 velocity(kStepMm, rate_hz);
    std::vector<double> t{0.0};
    std::vector<double> x, y, z;
    int even = 0;
    for (int i = 0; i < 20000; ++i) {
      const double passed = periods(random);
      if (i > 0) t.push_back(t.back() + passed);
      const double s = t.back() / rate_hz;
      // Even for a while, bent for a while, and shaken.
      x.push_back(quantised(20.0 * std::sin(2.0 * s), kStepMm));
      y.push_back(quantised(60.0 * s + (s > 2.0 ? 0.4 * std::sin(40.0 * s) : 0.0), kStepMm));
      z.push_back(quantised(5.0 * std::sin(15.0 * s), kStepMm));
      const hal::Vector3& v = velocity.update({x.back(), y.back(), z.back()}, passed);
      if (i < rate_hz / 1000.0) continue;  // fewer than a point's spacing
      const auto spacing = static_cast<std::size_t>(rate_hz / 1000.0);
      ASSERT_EQ(v.x, scanned(t, x, spacing, kStepMm) * rate_hz) << rate_hz << " Hz, tick " << i;
      ASSERT_EQ(v.y, scanned(t, y, spacing, kStepMm) * rate_hz) << rate_hz << " Hz, tick " << i;
      ASSERT_EQ(v.z, scanned(t, z, spacing, kStepMm) * rate_hz) << rate_hz << " Hz, tick " << i;
      even += velocity.window() == static_cast<int>(15 * spacing) ? 1 : 0;
    }
    EXPECT_GT(even, 1000) << "windows of all points, and others";
    EXPECT_LT(even, 19000);
  }
}

TEST(AdaptiveWindowVelocity, IsAsQuietAtAnyRate) {
  constexpr double kStepMm = 0.03;
  constexpr double kWindowS = 0.015;
  constexpr double kMmPerS = 11.3;
  for (const double rate_hz : {1000.0, 2000.0, 4000.0, 5000.0, 10000.0}) {
    AdaptiveWindowVelocity velocity(kStepMm, rate_hz);
    double worst_mm_per_s = 0.0;
    for (int i = 0; i < rate_hz; ++i) {
      velocity.update(quantised(kMmPerS * i / rate_hz, kStepMm));
      if (i > 2.0 * kWindowS * rate_hz) {
        worst_mm_per_s = std::max(worst_mm_per_s, std::abs(velocity.velocity_mm_per_s() - kMmPerS));
        EXPECT_LE(velocity.window(), kWindowS * rate_hz);
      }
    }
    EXPECT_GT(worst_mm_per_s, 0.0);
    EXPECT_LE(worst_mm_per_s, kStepMm / kWindowS * 1.001) << rate_hz << " Hz: a step over the window";
  }
}

TEST(AdaptiveWindowVelocity, IsRightFromTheSecondPositionAtAnyRate) {
  for (const double rate_hz : {500.0, 1000.0, 10000.0}) {
    for (const auto fit : {AdaptiveWindowVelocity::Fit::kEnd, AdaptiveWindowVelocity::Fit::kBest}) {
      AdaptiveWindowVelocity velocity(0.03, rate_hz, fit);
      EXPECT_EQ(velocity.update(5.0), 0.0);
      for (int i = 1; i < 400; ++i) {
        EXPECT_NEAR(velocity.update(5.0 + 80.0 * i / rate_hz), 80.0, 1e-6) << rate_hz << " Hz, " << i;
      }
    }
  }
}

}  // namespace
}  // namespace hapticd::rt
