#pragma once

#include <string>

#include "rt/model/models.h"

namespace hapticd::study {

/// What a model was identified from, for the report.
struct IdentificationResult {
  rt::ObjectModel model;
  /// What the dissertation's procedure gives: the Hunt-Crossley law from presses up to 6 N (the range of D
  /// Fig. 4.12), the same friction.
  rt::ObjectModel dissertation;
  double friction_error = 0.0;  ///< mean |error| over mean friction, on the data of the fit
};

/// Touches a simulated object as a user would and identifies all that a scene may ask for: presses and taps
/// at several speeds on one spot for the contact laws, strokes back and forth with the rod for its friction.
/// Only encoders and sensor are read, never the truth; no force is rendered meanwhile. On the high-force
/// device with its finer encoders. Throws std::runtime_error where a fit fails.
IdentificationResult identify(const std::string& object);

}  // namespace hapticd::study
