#pragma once

#include <optional>
#include <span>

#include "server/identification/gate/palpation_sample.h"

namespace hapticd::identification {

/// Surface of an object in a recording that does not say where it is.
struct SurfaceEstimate {
  double surface_mm = 0.0;
  double standard_error_mm = 0.0;
  double force_slope_n_per_mm = 0.0;  ///< of the first loading
};

/// Finds the surface from the first loading: the force of its first contact samples, up to a tenth of the
/// largest (and at least three times that at the begin of contact), is continued by a straight line down to
/// none. A preload at the start of the recording, which puts the surface before its zero, does no harm. None
/// if the force does not rise with the position.
std::optional<SurfaceEstimate> surface_from_first_loading(std::span<const PalpationSample> palpation);

}  // namespace hapticd::identification
