#include "rt/target/target_ramp.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

void TargetRamp::set(double goal, double ramp_s) noexcept {
  goal_ = goal;
  step_ = std::abs(goal - value_) / std::max(kMinRampPeriods, ramp_s * rate_hz_);
}

double TargetRamp::update(double periods, double displacement_mm) noexcept {
  const double remaining = goal_ - value_;
  if (remaining == 0.0) return value_;
  double step = step_ * periods;
  if (step * displacement_mm > max_change_n_ * periods) step = max_change_n_ * periods / displacement_mm;
  value_ = std::abs(remaining) <= step ? goal_ : value_ + std::copysign(step, remaining);
  return value_;
}

}  // namespace hapticd::rt
