#include "server/pose/tip_motion.h"

#include <algorithm>
#include <cmath>

namespace hapticd::pose {

void TipMotion::follow(const Eigen::Vector3d& position_mm, std::int64_t time_ns) noexcept {
  if (!position_mm.allFinite()) return;
  if (count_ > 0) {
    const std::int64_t step_ns = time_ns - before(0).ns;
    if (step_ns <= 0 || 1e-9 * static_cast<double>(step_ns) > kMaxGapS) {
      count_ = 0;
    } else if (step_ns < kMinStepNs) {
      return;
    }
  }
  newest_ = (newest_ + 1) % kKept;
  ring_[newest_] = {position_mm, time_ns};
  count_ = std::min(count_ + 1, kKept);
}

TipMotion::Velocity TipMotion::velocity() const noexcept {
  constexpr auto kWindowNs = static_cast<std::int64_t>(1e9 * kWindowS);
  std::size_t used = 0;
  double sum_s = 0.0;
  while (used < count_ && before(0).ns - before(used).ns <= kWindowNs) {
    sum_s -= 1e-9 * static_cast<double>(before(0).ns - before(used).ns);
    ++used;
  }
  if (used < 3) return {};
  // Times from the newest position, so that the differences keep their digits.
  const double mean_s = sum_s / static_cast<double>(used);
  double spread_s2 = 0.0;
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < used; ++i) {
    const double s = -1e-9 * static_cast<double>(before(0).ns - before(i).ns) - mean_s;
    spread_s2 += s * s;
    slope += s * (before(i).mm - before(0).mm);
  }
  return {slope / spread_s2, -mean_s, 1.0 / std::sqrt(spread_s2), true};
}

std::optional<Eigen::Vector3d> TipMotion::position_mm(std::int64_t time_ns) const noexcept {
  if (count_ == 0 || time_ns > before(0).ns) return std::nullopt;
  for (std::size_t age = 0; age < count_; ++age) {
    const Moment& earlier = before(age);
    if (earlier.ns > time_ns) continue;
    if (age == 0 || earlier.ns == time_ns) return earlier.mm;
    const Moment& later = before(age - 1);
    const double share =
        static_cast<double>(time_ns - earlier.ns) / static_cast<double>(later.ns - earlier.ns);
    return earlier.mm + share * (later.mm - earlier.mm);
  }
  return std::nullopt;
}

}  // namespace hapticd::pose
