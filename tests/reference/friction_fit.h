#pragma once

#include <vector>

#include "hal/error.h"
#include "hal/samples.h"
#include "rt/friction/friction_model.h"

namespace hapticd::identification {

/// One tick of strokes back and forth along one line of a surface.
struct StrokeSample {
  double along_mm = 0.0;  ///< coordinate along the line
  double along_mm_per_s = 0.0;
  hal::Vector3 reaction_n;  ///< of the object on the tool
};

struct FrictionFit {
  rt::FrictionParameters parameters;
  double relative_error = 0.0;  ///< mean |error| over mean friction
};

/// Friction of a solid tip from strokes back and forth, without knowing the surface: where the tip passes a
/// place both ways, friction turns its sign and the normal does not, so the mean direction of the reaction is
/// the normal. Then divide and conquer (D§4.4.1): μ_k and μ_b by linear least squares where more than 3 mm
/// were slid, the presliding way by a search over what the first millimetre after a turn shows. Fails if no
/// place was passed both ways.
hal::Result<FrictionFit> fit_friction(const std::vector<StrokeSample>& strokes, const hal::Vector3& along);

}  // namespace hapticd::identification
