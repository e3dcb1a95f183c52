// The measure by which traps of the loop are judged, against poles known beforehand.

#include "tests/measure/study/extremes/spectral_radius.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace hapticd::study::extremes {
namespace {

std::vector<double> recursion(double a, double b, int samples) {
  std::vector<double> y{1.0, 0.3};
  for (int k = 2; k < samples; ++k) y.push_back(a * y[y.size() - 1] + b * y[y.size() - 2]);
  return y;
}

TEST(SpectralRadius, OfRealPolesIsTheLarger) {
  EXPECT_NEAR(spectral_radius(recursion(0.9 - 0.4, 0.9 * 0.4, 30)), 0.9, 1e-9);
  EXPECT_NEAR(spectral_radius(recursion(-14.0 + 0.5, 14.0 * 0.5, 12)), 14.0, 1e-3);
}

TEST(SpectralRadius, OfAnOscillationIsItsGrowth) {
  const double radius = 1.01;
  const double a = 2.0 * radius * std::cos(0.7), b = -radius * radius;
  EXPECT_NEAR(spectral_radius(recursion(a, b, 60)), radius, 1e-9);
}

TEST(SpectralRadius, OfFirstOrder) {
  std::vector<double> y;
  for (int k = 0; k < 20; ++k) y.push_back(std::pow(-0.55, k));
  EXPECT_NEAR(spectral_radius(y), 0.55, 1e-9);
}

TEST(SpectralRadius, OfACourseThatComesDownToRounding) {
  // As a controller leaves it that approaches 1 N: the last deviations are nothing but rounding.
  std::vector<double> y;
  double force = 0.0;
  for (int k = 0; k < 24; ++k) {
    y.push_back(force - 1.0);
    force += 1.05 * (1.0 - force);
  }
  EXPECT_NEAR(spectral_radius(y), 0.05, 1e-5);
}

TEST(SpectralRadius, OfACourseThatIsOverAtOnceIsZero) {
  EXPECT_EQ(spectral_radius(std::array{1.0, 0.0, 0.0, 0.0, 0.0}), 0.0);
}

}  // namespace
}  // namespace hapticd::study::extremes
