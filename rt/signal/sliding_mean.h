#pragma once

#include <array>
#include <cstddef>

#include "rt/signal/ticks.h"

namespace hapticd::rt {

/// Mean of what a fixed time brought, up to 10 ticks. A tick's force is itself the mean of the sensor's
/// samples since the last tick, and noisier the faster the loop; over the same time it is as noisy at any
/// rate. `Value` is one number or a vector of three.
template <class Value>
class SlidingMean {
 public:
  static constexpr std::size_t kMaxTicks = 10;  ///< a millisecond at 10 kHz

  SlidingMean(double time_s, double rate_hz) noexcept
      : ticks_(std::min<std::size_t>(ticks_of(time_s, rate_hz), kMaxTicks)),
        share_(1.0 / static_cast<double>(ticks_)) {}

  Value update(const Value& value) noexcept {
    if (ticks_ == 1) return mean_ = value;
    values_[next_] = value;
    next_ = next_ + 1 < ticks_ ? next_ + 1 : 0;
    // Summed again: what was taken in once must not stay in the last digits for ever.
    Value sum = values_[0];
    for (std::size_t i = 1; i < ticks_; ++i) sum = sum + values_[i];
    mean_ = sum * share_;
    return mean_;
  }
  /// Fills the window as if the input had been `value` all the time.
  void seed(const Value& value) noexcept {
    values_.fill(value);
    mean_ = value;
  }
  const Value& mean() const noexcept { return mean_; }
  std::size_t ticks() const noexcept { return ticks_; }

 private:
  std::size_t ticks_;
  double share_;
  std::array<Value, kMaxTicks> values_{};
  std::size_t next_ = 0;
  Value mean_{};
};

}  // namespace hapticd::rt
