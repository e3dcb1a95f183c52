#pragma once

#include <algorithm>
#include <cmath>

#include "rt/signal/stiffness_fit.h"
#include "rt/signal/tick_interval.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Noise of a sensor: standard deviation of one tick's reading, each axis. Known from second differences:
/// what a hand, a load or a zero does changes less from one tick to the next. O(1) a tick.
template <class Value>
class BasicReadingNoise {
 public:
  /// One tick of a free tool. A jump counts as no more than kMaxDeviations.
  void update(const Value& reading_n, const TickInterval& interval) noexcept {
    constexpr double kOfSecondDifference = 6.0;  // 1 + 4 + 1
    const Value second_n = reading_n - last_n_[0] * 2.0 + last_n_[1];
    last_n_[1] = last_n_[0];
    last_n_[0] = reading_n;
    const double most_n = std::max(kMaxSeenN, kMaxDeviations * std::sqrt(variance_n2_));
    const double one_n =
        magnitude(second_n) / std::sqrt(kOfSecondDifference * stiffness_fit::components(Value{}));
    if (!(one_n >= 0.0)) return;
    const double seen_n = std::min(one_n, most_n);
    variance_n2_ += (seen_n * seen_n - variance_n2_) * (interval.s / (interval.s + kMemoryS));
  }
  void reset() noexcept { *this = {}; }

  /// What thresholds, which are made for a usual sensor, are raised by: 0 up to kQuietN.
  double excess_n() const noexcept {
    return variance_n2_ > kQuietN * kQuietN ? std::min(std::sqrt(variance_n2_), kMostN) - kUsualN : 0.0;
  }
  /// True if a contact can hardly be told from it.
  bool is_too_much() const noexcept { return variance_n2_ >= kMostN * kMostN; }

 private:
  static constexpr double kUsualN = 0.004;
  static constexpr double kQuietN = 0.006;
  static constexpr double kMostN = 0.025;
  static constexpr double kMaxSeenN = 0.012;
  static constexpr double kMaxDeviations = 3.0;
  static constexpr double kMemoryS = 0.5;

  Value last_n_[2]{};
  double variance_n2_ = 9e-6;
};

}  // namespace hapticd::rt
