#include "rt/contact/free_motion_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {
namespace {

constexpr double kToolMassG = 9.35;
constexpr std::int64_t kTickNs = 1'000'000;

double sine_depth_mm(double t, double amplitude_mm, double hz) {
  return amplitude_mm * std::sin(2.0 * std::numbers::pi * hz * t);
}

/// What the sensor reads of a free tool, averaged over the tick before t.
double sine_force_n(double t, double amplitude_mm, double hz) {
  const double omega = 2.0 * std::numbers::pi * hz;
  return -inertial_force_n(kToolMassG, omega * omega * sine_depth_mm(t - 0.5e-3, amplitude_mm, hz));
}

TEST(FreeMotionResidual, FreeMotionLeavesNothing) {
  for (const double hz : {1.0, 5.0, 8.0}) {
    FreeMotionResidual residual(kToolMassG, 1000.0);
    const double amplitude = 10.0 * 25.0 / (hz * hz);  // about 1 g of peak acceleration at each frequency
    double largest = 0.0;
    for (int i = 0; i < 20000; ++i) {
      const double t = i * 1e-3;
      const double depth = std::round(sine_depth_mm(t, amplitude, hz) / 0.03) * 0.03;
      const double r = residual.update(sine_force_n(t, amplitude, hz), depth, i * kTickNs, false);
      if (i > 500) largest = std::max(largest, std::abs(r));
    }
    EXPECT_LT(largest, 0.0075) << hz << " Hz: half the threshold, of a force of "
                               << inertial_force_n(kToolMassG,
                                                   std::pow(2.0 * std::numbers::pi * hz, 2) * amplitude)
                               << " N";
  }
}

TEST(FreeMotionResidual, ForceAtRestIsSeenWithinTheFiltersDelay) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  for (int i = 0; i < 100; ++i) residual.update(0.0, 5.0, i * kTickNs, false);
  int seen_after = -1;
  for (int i = 100; i < 200 && seen_after < 0; ++i) {
    if (std::abs(residual.update(0.02, 5.0, i * kTickNs, false)) > 0.015) seen_after = i - 100;
  }
  EXPECT_GT(seen_after, 5) << "20 mN may be a brisk start: the encoders must have had time to report";
  EXPECT_LT(seen_after, 20);
}

TEST(FreeMotionResidual, AnImpactIsSeenAtOnce) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  for (int i = 0; i < 100; ++i) residual.update(0.0, 0.1 * i, i * kTickNs, false);
  EXPECT_GT(residual.update(0.1, 10.0, 100 * kTickNs, false), 0.015);
}

TEST(FreeMotionResidual, ALateTickIsNoAcceleration) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  double largest = 0.0;
  std::int64_t tick = 0;
  for (int i = 0; i < 400; ++i) {
    tick += i % 50 == 49 ? 6 : 1;  // gaps of 5 ms at 400 mm/s
    const double r = residual.update(0.0, 0.4 * static_cast<double>(tick), tick * kTickNs, false);
    largest = std::max(largest, std::abs(r));
  }
  EXPECT_LT(largest, 1e-9);
}

TEST(FreeMotionResidual, StartedUnderLoadItReportsTheLoad) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  EXPECT_NEAR(residual.update(1.5, 0.0, 0, false), 1.5, 1e-12);
  EXPECT_NEAR(residual.update(1.5, 0.0, kTickNs, false), 1.5, 1e-9);
}

TEST(FreeMotionResidual, AssumedFreeItForgetsTheContact) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  std::int64_t tick = 0;
  // Retreating evenly, out of an object that pushed with 3 N until now.
  const auto depth_mm = [](std::int64_t t) { return 20.0 - 0.1 * static_cast<double>(t); };
  for (; tick < 200; ++tick) residual.update(3.0, depth_mm(tick), tick * kTickNs, true);
  for (; tick < 205; ++tick) residual.update(0.0, depth_mm(tick), tick * kTickNs, true);
  EXPECT_GT(std::abs(residual.residual_n()), 0.015) << "the filters remember";
  residual.assume_free();
  double largest = 0.0;
  for (; tick < 305; ++tick) {
    largest = std::max(largest, std::abs(residual.update(0.0, depth_mm(tick), tick * kTickNs, false)));
  }
  EXPECT_LT(largest, 1e-9);
}

TEST(FreeMotionResidual, ReadsAlmostAtOnceChangeNothing) {
  FreeMotionResidual residual(kToolMassG, 1000.0);
  for (int i = 0; i < 100; ++i) residual.update(0.0, 0.0, i * kTickNs, false);
  EXPECT_EQ(residual.update(0.0, 0.03, 99 * kTickNs + 1000, false), residual.residual_n())
      << "an encoder step within a microsecond is no acceleration of 3e10 mm/s²";
}

}  // namespace
}  // namespace hapticd::rt
