#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt/model/models.h"
#include "server/identification/gate/palpation_sample.h"
#include "tests/measure/study/identify/ceres_reference.h"
#include "tests/measure/study/identify/contact_palpation.h"

namespace hapticd::study {

/// What a method makes of a palpation: one of the two laws, or why none.
struct FittedLaw {
  std::optional<rt::HuntCrossleyParameters> hunt_crossley;
  std::optional<rt::CreepParameters> creep;
  std::string failed;
};

inline constexpr const char* kHuntCrossley = "hunt_crossley";
inline constexpr const char* kCreep = "creep";

/// A way to find a contact law.
struct ContactMethod {
  const char* name;
  const char* law;
  std::function<FittedLaw(const std::vector<identification::PalpationSample>&)> fit;
};

/// What the service has, recursive and batch for the Hunt-Crossley law and batch for the creep law; and the
/// candidate double_stage.
const std::vector<ContactMethod>& contact_methods();
/// Nonlinear least squares by Ceres, a block a sample.
const ContactMethod& contact_reference();

/// An estimator fed sample by sample, and asked at the end.
template <class Estimator>
FittedLaw fit_recursively(Estimator estimator,
                          const std::vector<identification::PalpationSample>& palpation) {
  for (const identification::PalpationSample& s : palpation) estimator.add(s);
  const auto estimate = estimator.estimate();
  return estimate ? FittedLaw{estimate->parameters, {}, {}} : FittedLaw{{}, {}, "not determined"};
}

/// Errors of a law that was found.
ContactErrors errors_of(const FittedLaw& fitted, const TruePalpation& palpation);

/// What a default identification of an object asks for and gets, until it has converged, at most a minute.
TruePalpation requested_palpation(const std::string& object);

}  // namespace hapticd::study
