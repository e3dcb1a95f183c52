#include "rt/control/force_controller.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "rt/control/default_gains.h"

namespace hapticd::rt {
namespace {

/// The loop of (3.6) with its own observer, everything passed on as commanded.
double run(const ControllerParameters& gains, double rate_hz, int ticks, double desired_n = 1.0) {
  ForceController controller(gains, rate_hz);
  double command = 0.0;
  for (int i = 0; i < ticks; ++i) {
    command = controller.update(desired_n);
    controller.applied(command);
  }
  return command;
}

double largest_pole(double kp, double kd) {
  const double b = -(1.0 - kp - kd);
  const std::complex<double> root = std::sqrt(std::complex<double>(b * b + 4.0 * kd, 0.0));
  return std::max(std::abs((-b + root) / 2.0), std::abs((-b - root) / 2.0));
}

TEST(ForceController, WithoutDerivativeIsAFirstOrderLag) {
  for (const double kp : {0.1, 0.45, 1.0, 1.05, 1.9}) {
    for (const int n : {1, 2, 5, 20}) {
      EXPECT_NEAR(run({ControlLaw::kClosedLoop, kp, 0.0}, 1000.0, n), 1.0 - std::pow(1.0 - kp, n), 1e-12);
    }
  }
}

TEST(ForceController, StableRegionIsThatOfTheCharacteristicPolynomial) {
  for (double kp = -0.5; kp < 2.5; kp += 0.0503) {
    for (double kd = -1.5; kd < 1.5; kd += 0.0507) {
      const ControllerParameters gains{ControlLaw::kClosedLoop, kp, kd};
      EXPECT_EQ(gains_are_stable(gains, 1000.0), largest_pole(kp, kd) < 1.0) << kp << ", " << kd;
    }
  }
}

TEST(ForceController, DerivativeGainKeepsItsMeaningAcrossRates) {
  // 0.25 ms is a quarter of a sample at 1 kHz and two and a half of them at 10 kHz, where it is refused.
  EXPECT_TRUE(gains_are_stable({ControlLaw::kClosedLoop, 0.45, 0.25}, 1000.0));
  EXPECT_FALSE(gains_are_stable({ControlLaw::kClosedLoop, 0.45, 0.25}, 10000.0));
}

TEST(ForceController, PublishedGainsPerSecondWouldDiverge) {
  // Kd 0.015 read as N/(N/s) is 15 per sample.
  const ControllerParameters per_second{ControlLaw::kClosedLoop, 0.45, 15.0};
  EXPECT_FALSE(gains_are_stable(per_second, 1000.0));
  EXPECT_NEAR(largest_pole(0.45, 15.0), 15.4, 0.2);
  EXPECT_GT(std::abs(run(per_second, 1000.0, 12)), 1e9);
  for (const char* device : {"phantom_1_0", "phantom_1_5_high_force", "anything else"}) {
    EXPECT_TRUE(gains_are_stable(default_gains(device), 1000.0));
    EXPECT_NEAR(run(default_gains(device), 1000.0, 200), 1.0, 1e-9);
  }
}

TEST(DefaultGains, AreTheDevicesTheOneWhoDrivesIt) {
  EXPECT_EQ(default_gains("phantom_premium_1_5_high_force").proportional_gain,
            default_gains("phantom_1_5_high_force").proportional_gain);
  EXPECT_EQ(default_gains("phantom_premium_1_0").proportional_gain,
            default_gains("phantom_1_0").proportional_gain);
  EXPECT_NE(default_gains("phantom_premium_1_5_high_force").proportional_gain,
            default_gains("phantom_premium_1_5").proportional_gain);
}

TEST(ForceController, SettlesWithin20MsWithoutRinging) {
  const auto settles = [](double gain, double derivative_ms, double rate_hz) {
    return gains_settle({ControlLaw::kClosedLoop, gain, derivative_ms}, rate_hz);
  };
  for (const double rate_hz : {500.0, 1000.0, 5000.0, 10000.0}) {
    const double least = 1.0 / (0.02 * rate_hz);
    EXPECT_TRUE(settles(least, 0.0, rate_hz)) << rate_hz;
    EXPECT_FALSE(settles(0.99 * least, 0.0, rate_hz)) << rate_hz;
    for (const char* device : {"phantom_1_0", "phantom_1_5_high_force"}) {
      EXPECT_TRUE(gains_settle(default_gains(device), rate_hz)) << device << rate_hz;
    }
  }
  EXPECT_FALSE(settles(0.02, 0.98, 1000.0)) << "stable, and slow";
  EXPECT_FALSE(settles(0.1, -0.95, 1000.0)) << "stable, and swings";
  EXPECT_FALSE(settles(1.9, 0.0, 1000.0)) << "stable, and alternates";
  EXPECT_FALSE(settles(std::nan(""), 0.0, 1000.0));
  EXPECT_TRUE(gains_settle({ControlLaw::kOpenLoop, 0.0, 0.0}, 1000.0));
  // What it promises: a step is followed to 5 % within 60 ms.
  for (const double gain : {0.05, 0.2, 1.0, 1.7}) {
    for (const double derivative_ms : {-0.5, -0.1, 0.0, 0.1, 0.3}) {
      const ControllerParameters p{ControlLaw::kClosedLoop, gain, derivative_ms};
      if (!gains_settle(p, 1000.0)) continue;
      EXPECT_NEAR(run(p, 1000.0, 61), 1.0, 0.06) << gain << ", " << derivative_ms;
    }
  }
}

TEST(ForceController, ABoundedCommandDoesNotWindUp) {
  ForceController controller(default_gains("phantom_1_0"), 1000.0);
  for (int i = 0; i < 100000; ++i) controller.applied(std::min(8.5, controller.update(50.0)));
  double command = 0.0;
  for (int i = 0; i < 20; ++i) {
    command = controller.update(1.0);
    controller.applied(command);
  }
  EXPECT_NEAR(command, 1.0, 1e-3) << "back within a few ticks, whatever was asked of it before";
}

TEST(ForceController, OpenLoopPassesTheDesiredForce) {
  ForceController controller({ControlLaw::kOpenLoop, 0.0, 0.0}, 1000.0);
  EXPECT_EQ(controller.update(-3.0), -3.0);
}

}  // namespace
}  // namespace hapticd::rt
