#pragma once

#include <string>

#include "rt/model/identified_model.h"
#include "rt/model/models.h"

namespace hapticd::study {

/// What the service's own identifications find on a simulated object.
struct IdentificationResult {
  rt::ObjectModel model;
  /// What the dissertation's procedure gives: the Hunt-Crossley law from presses up to 6 N (the range of D
  /// Fig. 4.12), the same friction.
  rt::ObjectModel dissertation;
  rt::IdentifiedModel contact, friction;  ///< that the model is put together from
};

/// Does what `identify contact` and `identify friction` request, on the high-force device with its finer
/// encoders, and puts together what they find as the service does. Only encoders and sensor are read, never
/// the truth; no force is rendered meanwhile. Minutes of virtual time, seconds of real. Throws
/// std::runtime_error if an identification fails.
IdentificationResult identify(const std::string& object);

/// Model of server/model/shipped. Throws std::runtime_error if there is none.
rt::ObjectModel shipped_model(const std::string& object);

}  // namespace hapticd::study
