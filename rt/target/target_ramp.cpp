#include "rt/target/target_ramp.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

void TargetRamp::set(double goal, double ramp_s) noexcept {
  goal_ = goal;
  step_ = std::abs(goal - value_) / std::max(1.0, ramp_s * rate_hz_);
}

double TargetRamp::update(double periods) noexcept {
  const double remaining = goal_ - value_;
  const double step = step_ * periods;
  value_ = std::abs(remaining) <= step ? goal_ : value_ + std::copysign(step, remaining);
  return value_;
}

}  // namespace hapticd::rt
