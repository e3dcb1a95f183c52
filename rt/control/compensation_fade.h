#pragma once

#include <algorithm>

#include "rt/target/largest_target.h"

namespace hapticd::rt {

/// All of the compensations below the first, nothing of them from the second on, in N/mm.
inline constexpr double kCompensatedBelowNPerMm = 0.75 * kMaxTargetNPerMm;
inline constexpr double kUncompensatedFromNPerMm = 0.95 * kMaxTargetNPerMm;

/// Share of the reaction's lead and of the back-drive compensation that acts at a target, 0 … 1. Both take
/// damping away: the lead what the loop's delay adds while it softens, the other the device's dry friction. A
/// soft target can spare it. A stiff one cannot: rendered with a delay τ it takes k~ τ of damping itself, and
/// a hand that a large change of the target set swinging would not come to rest.
constexpr double compensation_share(double target_n_per_mm) noexcept {
  return std::clamp(
      (kUncompensatedFromNPerMm - target_n_per_mm) / (kUncompensatedFromNPerMm - kCompensatedBelowNPerMm),
      0.0, 1.0);
}

}  // namespace hapticd::rt
