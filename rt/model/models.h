#pragma once

#include <array>
#include <optional>
#include <string>

#include "hal/error.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/friction/friction_model.h"

namespace hapticd::rt {

/// A law identified on an object and how well it fits.
template <class Parameters>
struct IdentifiedLaw {
  Parameters parameters;
  double relative_error = 0.1;  ///< rms of x̂/x - 1 over the palpation; the estimator's trust rests on it
};

/// What was identified on one object. A scene asks for the parts it needs; those that are missing are named
/// when it is loaded.
struct ObjectModel {
  std::string name;                  ///< of the object, and of the model's file
  std::string identified_on;         ///< rig and procedure
  double max_displacement_mm = 0.0;  ///< what the palpation covered
  double max_force_n = 0.0;
  std::optional<IdentifiedLaw<HuntCrossleyParameters>> hunt_crossley;
  std::optional<IdentifiedLaw<CreepParameters>> creep;
  std::optional<FrictionParameters> rod_friction;
  std::optional<FrictionParameters> bearing_friction;  ///< none: kBallBearingFriction
};

/// Force over displacement at this force (> 0), in N/mm, once the object has settled: by the creep law, else
/// by Hunt-Crossley's; none if the model has neither.
std::optional<double> stiffness_n_per_mm(const ObjectModel& model, double force_n);

/// Checks that Maxwell-slip elements, if there are any, are finite and in range, their level that of the
/// friction; the error names the key, after `prefix`.
std::optional<hal::Error> check_maxwell_slip(const FrictionParameters& friction, const std::string& prefix,
                                             const std::string& where);

/// Checks that all is finite and inside the range its laws are made for: exponent 1 … 3, K from 1e-4 to 1e3,
/// a curve that rises from zero, weights ≥ 0; Maxwell-slip elements (of a rod only) whose level is the
/// friction's own. The error names the model and the key.
std::optional<hal::Error> check(const ObjectModel& model);

}  // namespace hapticd::rt
