#include "hal/sim/hand/minimum_jerk.h"

#include <algorithm>

namespace hapticd::sim {

MinimumJerk::MinimumJerk(const MotionState& from, const MotionState& to, double duration_s) noexcept
    : duration_s_(duration_s), end_(to) {
  const double t = duration_s;
  const double dx = to.position_mm - from.position_mm - from.velocity_mm_per_s * t -
                    0.5 * from.acceleration_mm_per_s2 * t * t;
  const double dv = (to.velocity_mm_per_s - from.velocity_mm_per_s - from.acceleration_mm_per_s2 * t) * t;
  const double da = (to.acceleration_mm_per_s2 - from.acceleration_mm_per_s2) * t * t;
  const double t3 = t * t * t;
  c_[0] = from.position_mm;
  c_[1] = from.velocity_mm_per_s;
  c_[2] = 0.5 * from.acceleration_mm_per_s2;
  c_[3] = (10.0 * dx - 4.0 * dv + 0.5 * da) / t3;
  c_[4] = (-15.0 * dx + 7.0 * dv - da) / (t3 * t);
  c_[5] = (6.0 * dx - 3.0 * dv + 0.5 * da) / (t3 * t * t);
}

MotionState MinimumJerk::at(double time_s) const noexcept {
  if (time_s >= duration_s_) return end_;
  const double t = std::max(0.0, time_s);
  return {c_[0] + t * (c_[1] + t * (c_[2] + t * (c_[3] + t * (c_[4] + t * c_[5])))),
          c_[1] + t * (2.0 * c_[2] + t * (3.0 * c_[3] + t * (4.0 * c_[4] + t * 5.0 * c_[5]))),
          2.0 * c_[2] + t * (6.0 * c_[3] + t * (12.0 * c_[4] + t * 20.0 * c_[5]))};
}

}  // namespace hapticd::sim
