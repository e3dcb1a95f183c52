#pragma once

#include <cmath>
#include <numbers>

#include "hal/samples.h"

namespace hapticd::rt {

/// Second-order Butterworth low-pass, bilinear transform with the cut-off prewarped, so the gain at the
/// cut-off is exactly 1/√2. Gain 1 and group delay √2 / (2π cutoff) at low frequency (4.5 ms at 50 Hz).
/// `Value` is one number, a vector of three, or any other signal that can be added and scaled.
template <class Value>
class BasicButterworthLowPass {
 public:
  /// 0 < cutoff_hz < rate_hz / 2.
  BasicButterworthLowPass(double cutoff_hz, double rate_hz) noexcept {
    const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
    const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
    b0_ = k * k * norm;
    a1_ = 2.0 * (k * k - 1.0) * norm;
    a2_ = (1.0 - std::numbers::sqrt2 * k + k * k) * norm;
  }

  Value update(const Value& input) noexcept {
    const Value fed = input * b0_;
    output_ = fed + s1_;
    s1_ = fed + fed - output_ * a1_ + s2_;
    s2_ = fed - output_ * a2_;
    return output_;
  }
  /// Settles at `value` as if it had been the input for ever: no start-up transient.
  void seed(const Value& value) noexcept {
    output_ = value;
    s1_ = value * (1.0 - b0_);
    s2_ = value * (b0_ - a2_);
  }
  const Value& output() const noexcept { return output_; }
  static double low_frequency_delay_s(double cutoff_hz) noexcept {
    return std::numbers::sqrt2 / (2.0 * std::numbers::pi * cutoff_hz);
  }

 private:
  double b0_, a1_, a2_;  // b1 = 2 b0, b2 = b0
  Value s1_{}, s2_{};    // transposed direct form II
  Value output_{};
};

using ButterworthLowPass = BasicButterworthLowPass<double>;
using ButterworthLowPass3 = BasicButterworthLowPass<hal::Vector3>;

}  // namespace hapticd::rt
