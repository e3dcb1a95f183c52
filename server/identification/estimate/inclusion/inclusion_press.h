#pragma once

#include <optional>
#include <vector>

#include "hal/samples.h"

namespace hapticd::identification {

/// One sample of a press: where the tip is, how fast, and the force on it.
struct PressSample {
  hal::Vector3 tip_mm;
  hal::Vector3 velocity_mm_per_s;
  hal::Vector3 force_n;
};

/// One press: where the surface was met, and what came after, until the tip was free again.
struct Press {
  /// Share of the threshold: the surface is where the force was within it last, as the tick places an onset.
  static constexpr double kQuietShare = 1.0 / 3.0;
  /// Largest distance back at which the surface is looked for.
  static constexpr double kMaxLateMm = 2.0;

  hal::Vector3 surface_mm;
  std::vector<PressSample> samples;
};

/// Surface that a press met, whose force exceeds the threshold at `tip_mm` and was quiet at `quiet_mm` last.
hal::Vector3 surface_before(const std::optional<hal::Vector3>& quiet_mm, const hal::Vector3& tip_mm);

}  // namespace hapticd::identification
