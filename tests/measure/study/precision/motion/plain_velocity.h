#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::study {

/// Ways to a velocity that hapticd does not ship. Each takes one position a tick, the first at rest.

/// (y_k - y_{k-1}) / T.
class PlainDifference {
 public:
  explicit PlainDifference(double rate_hz) noexcept : rate_hz_(rate_hz) {}

  double update(double position_mm) noexcept {
    const double velocity = started_ ? (position_mm - last_mm_) * rate_hz_ : 0.0;
    started_ = true;
    last_mm_ = position_mm;
    return velocity;
  }

 private:
  double rate_hz_;
  bool started_ = false;
  double last_mm_ = 0.0;
};

/// The difference through a second-order Butterworth low-pass.
class FilteredDifference {
 public:
  FilteredDifference(double cutoff_hz, double rate_hz) noexcept
      : difference_(rate_hz), filter_(cutoff_hz, rate_hz) {}
  double update(double position_mm) noexcept { return filter_.update(difference_.update(position_mm)); }

 private:
  PlainDifference difference_;
  rt::ButterworthLowPass filter_;
};

/// Slope of the least-squares line through the last n + 1 positions, n fixed:
///   6 Σ_{i=0..n} (n - 2i) y_{k-i} / (T n (n+1) (n+2)).
class FixedWindowVelocity {
 public:
  static constexpr std::size_t kMaxPeriods = 31;

  /// 1 ≤ `periods` ≤ kMaxPeriods.
  FixedWindowVelocity(std::size_t periods, double rate_hz) noexcept : periods_(periods) {
    const auto n = static_cast<double>(periods);
    for (std::size_t i = 0; i <= periods; ++i) {
      weight_[i] = 6.0 * (n - 2.0 * static_cast<double>(i)) * rate_hz / (n * (n + 1.0) * (n + 2.0));
    }
  }

  double update(double position_mm) noexcept {
    if (!started_) positions_.fill(position_mm);
    started_ = true;
    newest_ = (newest_ + 1) & kMaxPeriods;
    positions_[newest_] = position_mm;
    double slope = 0.0;
    for (std::size_t i = 0; i <= periods_; ++i) slope += weight_[i] * positions_[(newest_ - i) & kMaxPeriods];
    return slope;
  }

 private:
  std::size_t periods_;
  bool started_ = false;
  std::size_t newest_ = 0;
  std::array<double, kMaxPeriods + 1> weight_{};
  std::array<double, kMaxPeriods + 1> positions_{};
};

/// Levant's robust exact differentiator (1998), explicit Euler:
///   e = x_0 - y,  ẋ_0 = x_1 - 1.5 √L |e|^½ sgn e,  ẋ_1 = -1.1 L sgn e,
/// exact for |acceleration| < L without noise; x_1 is the velocity.
class LevantDifferentiator {
 public:
  LevantDifferentiator(double largest_acceleration_mm_per_s2, double rate_hz) noexcept
      : largest_(largest_acceleration_mm_per_s2), period_s_(1.0 / rate_hz) {}

  double update(double position_mm) noexcept {
    if (!started_) position_mm_ = position_mm;
    started_ = true;
    const double error_mm = position_mm_ - position_mm;
    const double sign = error_mm == 0.0 ? 0.0 : std::copysign(1.0, error_mm);
    position_mm_ += period_s_ * (velocity_mm_per_s_ - 1.5 * std::sqrt(largest_ * std::abs(error_mm)) * sign);
    velocity_mm_per_s_ -= period_s_ * 1.1 * largest_ * sign;
    return velocity_mm_per_s_;
  }

 private:
  double largest_;
  double period_s_;
  bool started_ = false;
  double position_mm_ = 0.0;
  double velocity_mm_per_s_ = 0.0;
};

}  // namespace hapticd::study
