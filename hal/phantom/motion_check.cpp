#include "hal/phantom/motion_check.h"

#include <algorithm>
#include <cmath>

namespace hapticd::phantom {

namespace {
constexpr double kMinStepS = 1e-3;
constexpr double kMaxStepS = 0.1;  // after a longer pause the arm may have moved as far as in this time
constexpr double kCountsToSpare = 4.0;
constexpr std::int64_t kSpeedSpanNs = 2'000'000;
constexpr double kSlowAgainShare = 0.9;
constexpr double kSPerNs = 1e-9;
}  // namespace

void MotionCheck::restart() noexcept {
  has_joints_ = false;
  has_tip_ = false;
  over_speed_ = false;
  jumped_joint_ = -1;
}

bool MotionCheck::plausible(const JointAngles& q, std::int64_t now_ns) noexcept {
  if (has_joints_) {
    const double dt_s = std::clamp(kSPerNs * static_cast<double>(now_ns - last_ns_), kMinStepS, kMaxStepS);
    for (std::size_t i = 0; i < 3; ++i) {
      const double max_rad = max_joint_speed_rad_per_s_ * dt_s + kCountsToSpare * std::abs(rad_per_count_[i]);
      if (std::abs(q[i] - last_q_rad_[i]) <= max_rad) continue;
      jumped_joint_ = static_cast<int>(i);
      return false;
    }
  }
  has_joints_ = true;
  last_q_rad_ = q;
  last_ns_ = now_ns;
  return true;
}

void MotionCheck::follow(const hal::Vector3& tip_mm, std::int64_t now_ns) noexcept {
  if (!has_tip_) {
    has_tip_ = true;
    reference_mm_ = tip_mm;
    reference_ns_ = now_ns;
    return;
  }
  if (now_ns - reference_ns_ < kSpeedSpanNs) return;
  const hal::Vector3 step_mm = tip_mm - reference_mm_;
  const double speed_mm_per_s =
      std::sqrt(dot(step_mm, step_mm)) / (kSPerNs * static_cast<double>(now_ns - reference_ns_));
  over_speed_ = speed_mm_per_s > max_speed_mm_per_s_ * (over_speed_ ? kSlowAgainShare : 1.0);
  reference_mm_ = tip_mm;
  reference_ns_ = now_ns;
}

}  // namespace hapticd::phantom
