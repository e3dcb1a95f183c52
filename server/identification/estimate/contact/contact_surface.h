#pragma once

#include <optional>
#include <span>

#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Where the surface of an object lies in a recording that does not say so.
struct SurfaceEstimate {
  double surface_mm = 0.0;
  double standard_error_mm = 0.0;
  double force_slope_n_per_mm = 0.0;  ///< of the first loading
};

/// From the first loading: the force of its first contact samples, up to a tenth of the largest (and at least
/// three times where contact began), is continued by a straight line down to none. A preload at the start of
/// the recording, which puts the surface before its zero, is no obstacle. None where the force does not rise
/// with the position.
std::optional<SurfaceEstimate> surface_from_first_loading(std::span<const PalpationSample> palpation);

}  // namespace hapticd::identification
