#include "rt/signal/butterworth_low_pass.h"

#include <cmath>
#include <numbers>

namespace hapticd::rt {

template <class Value>
BasicButterworthLowPass<Value>::BasicButterworthLowPass(double cutoff_hz, double rate_hz) noexcept {
  const double k = std::tan(std::numbers::pi * cutoff_hz / rate_hz);
  const double norm = 1.0 / (1.0 + std::numbers::sqrt2 * k + k * k);
  b0_ = k * k * norm;
  a1_ = 2.0 * (k * k - 1.0) * norm;
  a2_ = (1.0 - std::numbers::sqrt2 * k + k * k) * norm;
}

template <class Value>
void BasicButterworthLowPass<Value>::seed(const Value& value) noexcept {
  output_ = value;
  s1_ = value * (1.0 - b0_);
  s2_ = value * (b0_ - a2_);
}

template <class Value>
double BasicButterworthLowPass<Value>::low_frequency_delay_s(double cutoff_hz) noexcept {
  return std::numbers::sqrt2 / (2.0 * std::numbers::pi * cutoff_hz);
}

template class BasicButterworthLowPass<double>;
template class BasicButterworthLowPass<hal::Vector3>;

}  // namespace hapticd::rt
