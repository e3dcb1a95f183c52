#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::rt {
namespace {

double gain_at(double frequency_hz, double cutoff_hz, double rate_hz) {
  ButterworthLowPass filter(cutoff_hz, rate_hz);
  const double omega = 2.0 * std::numbers::pi * frequency_hz / rate_hz;
  double in_phase = 0.0;
  double quadrature = 0.0;
  const int settle = static_cast<int>(40.0 * rate_hz / cutoff_hz);
  const int periods = static_cast<int>(std::round(200.0 * rate_hz / frequency_hz));
  for (int i = 0; i < settle + periods; ++i) {
    const double out = filter.update(std::sin(omega * i));
    if (i < settle) continue;
    in_phase += out * std::sin(omega * i);
    quadrature += out * std::cos(omega * i);
  }
  return 2.0 * std::hypot(in_phase, quadrature) / periods;
}

TEST(ButterworthLowPass, HasTheAnalogueMagnitudeAtWarpedFrequencies) {
  for (const double cutoff : {50.0, 60.0, 70.0}) {
    EXPECT_NEAR(gain_at(cutoff, cutoff, 1000.0), 1.0 / std::numbers::sqrt2, 1e-4);
    for (const double f : {5.0, 20.0, 100.0, 200.0}) {
      const double warp =
          std::tan(std::numbers::pi * f / 1000.0) / std::tan(std::numbers::pi * cutoff / 1000.0);
      EXPECT_NEAR(gain_at(f, cutoff, 1000.0), 1.0 / std::sqrt(1.0 + std::pow(warp, 4)), 2e-4) << f << " Hz";
    }
  }
}

TEST(ButterworthLowPass, SeededItHasNoTransient) {
  ButterworthLowPass filter(50.0, 1000.0);
  filter.seed(-3.25);
  for (int i = 0; i < 1000; ++i) ASSERT_NEAR(filter.update(-3.25), -3.25, 1e-12);
}

TEST(ButterworthLowPass, RampLagsByTheStatedDelay) {
  ButterworthLowPass filter(50.0, 1000.0);
  filter.seed(0.0);
  double out = 0.0;
  for (int i = 0; i <= 2000; ++i) out = filter.update(i * 1e-3);
  EXPECT_NEAR(2.0 - out, ButterworthLowPass::low_frequency_delay_s(50.0), 5e-5);
}

TEST(ButterworthLowPass, StaysBoundedForTenHoursOfNoise) {
  ButterworthLowPass filter(50.0, 1000.0);
  std::uint32_t state = 1;
  double largest = 0.0;
  for (int i = 0; i < 36'000'000; ++i) {
    state = state * 1664525U + 1013904223U;
    largest = std::max(largest, std::abs(filter.update(static_cast<double>(state) / 2147483648.0 - 1.0)));
  }
  EXPECT_LT(largest, 1.2) << "a bounded input of 1 cannot exceed the step response's overshoot";
  for (int i = 0; i < 100000; ++i) filter.update(0.0);
  EXPECT_EQ(filter.output(), filter.output());
  EXPECT_LT(std::abs(filter.output()), 1e-30);
}

}  // namespace
}  // namespace hapticd::rt
