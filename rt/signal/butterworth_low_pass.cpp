#include "rt/signal/butterworth_low_pass.h"

#include <cmath>
#include <numbers>

namespace hapticd::rt {

ButterworthLowPass::ButterworthLowPass(double cutoff_hz, double rate_hz) noexcept {
  const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  b0_ = k * k * norm;
  a1_ = 2.0 * (k * k - 1.0) * norm;
  a2_ = (1.0 - std::numbers::sqrt2 * k + k * k) * norm;
}

double ButterworthLowPass::update(double input) noexcept {
  output_ = b0_ * input + s1_;
  s1_ = 2.0 * b0_ * input - a1_ * output_ + s2_;
  s2_ = b0_ * input - a2_ * output_;
  return output_;
}

void ButterworthLowPass::seed(double value) noexcept {
  output_ = value;
  s1_ = (1.0 - b0_) * value;
  s2_ = (b0_ - a2_) * value;
}

double ButterworthLowPass::low_frequency_delay_s(double cutoff_hz) noexcept {
  return std::numbers::sqrt2 / (2.0 * std::numbers::pi * cutoff_hz);
}

}  // namespace hapticd::rt
