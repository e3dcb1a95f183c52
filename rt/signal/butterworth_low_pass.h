#pragma once

namespace hapticd::rt {

/// Second-order Butterworth low-pass, bilinear transform with the cut-off prewarped, so the gain at the
/// cut-off is exactly 1/√2. Gain 1 and group delay √2 / (2π cutoff) at low frequency (4.5 ms at 50 Hz).
class ButterworthLowPass {
 public:
  /// 0 < cutoff_hz < rate_hz / 2.
  ButterworthLowPass(double cutoff_hz, double rate_hz) noexcept;

  double update(double input) noexcept;
  /// Settles at `value` as if it had been the input for ever: no start-up transient.
  void seed(double value) noexcept;
  double output() const noexcept { return output_; }
  static double low_frequency_delay_s(double cutoff_hz) noexcept;

 private:
  double b0_, a1_, a2_;         // b1 = 2 b0, b2 = b0
  double s1_ = 0.0, s2_ = 0.0;  // transposed direct form II
  double output_ = 0.0;
};

}  // namespace hapticd::rt
