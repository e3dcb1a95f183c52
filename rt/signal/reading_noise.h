#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "rt/signal/stiffness_fit.h"

namespace hapticd::rt {

/// Noise of a force sensor: standard deviation of its mean over a millisecond, each axis. Known from second
/// differences of the reading: what a hand, a load or a zero does changes less from one tick to the next.
/// Only readings at even distances count, for after a late one the motion looks like noise. O(1) a tick.
template <class Value>
class BasicReadingNoise {
 public:
  /// Takes what the sensor reads with a free tool, inertia and all, and the instant that it stands for. A
  /// jump counts as no more than kMaxDeviations.
  void update(const Value& reading_n, std::int64_t reading_ns) noexcept {
    const double s = 1e-9 * static_cast<double>(reading_ns - last_ns_);
    if (!(s > 0.0)) return;  // an old one
    const bool is_even = s < kMaxIntervalS && std::abs(s - last_s_) < kUneven * s;
    const Value second_n = reading_n - last_n_[0] * 2.0 + last_n_[1];
    last_n_[1] = last_n_[0];
    last_n_[0] = reading_n;
    last_ns_ = reading_ns;
    last_s_ = s;
    if (!is_even) return;
    constexpr double kOfSecondDifference = 6.0;  // 1 + 4 + 1
    constexpr double kShare = 1.0 / (kOfSecondDifference * stiffness_fit::components(Value{}));
    const double one_n2 = stiffness_fit::inner(second_n, second_n) * kShare * std::min(1.0, s / kMeanS);
    const double most_n2 = std::max(kMaxSeenN * kMaxSeenN, kMaxDeviations * kMaxDeviations * variance_n2_);
    if (!(one_n2 >= 0.0)) return;
    variance_n2_ += (std::min(one_n2, most_n2) - variance_n2_) * (s / kMemoryS);
  }

  /// Noise beyond a usual sensor's, for which thresholds are made; 0 up to kQuietN.
  double excess_n() const noexcept {
    return variance_n2_ > kQuietN * kQuietN ? std::min(std::sqrt(variance_n2_), kMostN) - kUsualN : 0.0;
  }
  /// True if contacts are missed because of it.
  bool is_too_much() const noexcept { return variance_n2_ >= kTooMuchN * kTooMuchN; }

 private:
  static constexpr double kMeanS = 1e-3;
  static constexpr double kMaxIntervalS = 2.5e-3;
  static constexpr double kUneven = 0.2;
  static constexpr double kUsualN = 0.004;
  static constexpr double kQuietN = 0.006;
  static constexpr double kTooMuchN = 0.018;
  static constexpr double kMostN = 0.025;
  static constexpr double kMaxSeenN = 0.012;
  static constexpr double kMaxDeviations = 3.0;
  static constexpr double kMemoryS = 0.5;

  Value last_n_[2]{};
  std::int64_t last_ns_ = 0;
  double last_s_ = 0.0;
  double variance_n2_ = 9e-6;
};

}  // namespace hapticd::rt
