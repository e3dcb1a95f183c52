#pragma once

#include <string>

#include "rt/friction/friction_model.h"

namespace hapticd::study {

/// What a friction model is worth where a scene renders with it.
struct RenderedFriction {
  double friction_error = 0.0;      ///< mean |estimated - true| over mean |true|, as vectors
  double direction_mean_rad = 0.0;  ///< of the estimated normal from the true one
  double direction_p95_rad = 0.0;   ///< 95 % of the time below
};

/// Two strokes of the rod back and forth with 4 N and up to 90 mm/s, the tool swaying, on the family of
/// objects under way, without device force: the tracked direction of an explore scene, from sensor and
/// encoders, with this friction, against the simulator's own. Turns included, from 0.2 s after each onset on,
/// above 0.5 N. Another seed than the identification's. Throws std::runtime_error if nothing was touched.
RenderedFriction rendered_friction(const std::string& object, const rt::FrictionParameters& friction);

}  // namespace hapticd::study
