#pragma once

#include <cmath>

namespace hapticd::rt {

/// What a first-order lag keeps of its past over a measured interval, e^(-t/τ). Around the nominal interval
/// by the (2,2) Padé approximant of the difference, between 0 and 1 and within 1e-5 for t up to τ/2 off;
/// exact where an interval is far from nominal.
class Decay {
 public:
  /// `time_s`: τ > 0.
  Decay(double time_s, double rate_hz) noexcept
      : per_period_(1.0 / (time_s * rate_hz)), nominal_(std::exp(-per_period_)) {}
  Decay() noexcept = default;

  double nominal() const noexcept { return nominal_; }
  /// Decay over so many periods of the loop, ≥ 0.
  double over(double periods) const noexcept {
    const double x = (periods - 1.0) * per_period_;
    if (x == 0.0) return nominal_;
    if (!(std::abs(x) < 0.5)) return std::exp(-periods * per_period_);
    const double even = 1.0 + x * x * (1.0 / 12.0);
    return nominal_ * (even - 0.5 * x) / (even + 0.5 * x);
  }

 private:
  double per_period_ = 0.0;
  double nominal_ = 1.0;
};

}  // namespace hapticd::rt
