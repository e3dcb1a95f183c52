#pragma once

#include <algorithm>

#include "hal/sim/hand/hand.h"

namespace hapticd::sim {

// How far, how high and how long the phases of a hand program are.

inline constexpr double kHomeHeightMm = 10.0;
inline constexpr double kStrikeShare = 1.9;  // duration of a strike, of a rebound: times way over speed
inline constexpr double kReboundShare = 2.0;
inline constexpr double kMeanPerPeak = 1.875;  // of a minimum-jerk motion
inline constexpr double kScanHeightMm = 3.0;
inline constexpr double kScanSettleS = 0.4;
inline constexpr double kWaveBuildsUpS = 1.0;

inline double tap_depth_mm(double speed_mm_per_s) noexcept {
  return std::max(3.0, 0.01 * speed_mm_per_s);
}
inline double tap_return_s(double height_mm, double speed_mm_per_s) noexcept {
  return std::max(0.2, 3.0 * height_mm / speed_mm_per_s);
}
inline double height_of_tap_mm(double speed_mm_per_s) noexcept {
  return std::clamp(0.08 * speed_mm_per_s, 15.0, 80.0);
}
inline double scan_depth_mm(const HandProgram& program) noexcept {
  return program.depth_mm > 0.0 ? program.depth_mm : 1.0;
}
inline double scan_return_s(const HandProgram& program) noexcept {
  return std::max(0.25, 3.0 * kScanHeightMm / program.speed_mm_per_s);
}
inline double load_s_of(const HandProgram& program) noexcept {
  const bool by_depth = program.kind == HandProgram::Kind::kPress && program.depth_mm > 0.0;
  return by_depth ? kMeanPerPeak * program.depth_mm / program.approach_mm_per_s
                  : kMeanPerPeak * program.force_n / program.force_rate_n_per_s;
}

}  // namespace hapticd::sim
