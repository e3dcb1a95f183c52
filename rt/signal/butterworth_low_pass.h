#pragma once

#include "hal/samples.h"

namespace hapticd::rt {

/// Second-order Butterworth low-pass, bilinear transform with the cut-off prewarped, so the gain at the
/// cut-off is exactly 1/√2. Gain 1 and group delay √2 / (2π cutoff) at low frequency (4.5 ms at 50 Hz).
/// `Value` is one number or a vector of three.
template <class Value>
class BasicButterworthLowPass {
 public:
  /// 0 < cutoff_hz < rate_hz / 2.
  BasicButterworthLowPass(double cutoff_hz, double rate_hz) noexcept;

  Value update(const Value& input) noexcept {
    output_ = input * b0_ + s1_;
    s1_ = input * (2.0 * b0_) - output_ * a1_ + s2_;
    s2_ = input * b0_ - output_ * a2_;
    return output_;
  }
  /// Settles at `value` as if it had been the input for ever: no start-up transient.
  void seed(const Value& value) noexcept;
  const Value& output() const noexcept { return output_; }
  static double low_frequency_delay_s(double cutoff_hz) noexcept;

 private:
  double b0_, a1_, a2_;  // b1 = 2 b0, b2 = b0
  Value s1_{}, s2_{};    // transposed direct form II
  Value output_{};
};

using ButterworthLowPass = BasicButterworthLowPass<double>;
using ButterworthLowPass3 = BasicButterworthLowPass<hal::Vector3>;
extern template class BasicButterworthLowPass<double>;
extern template class BasicButterworthLowPass<hal::Vector3>;

}  // namespace hapticd::rt
