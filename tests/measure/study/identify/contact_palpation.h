#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "rt/model/identified_model.h"
#include "rt/model/models.h"
#include "server/identification/gate/palpation_sample.h"
#include "server/identification/session/identification.h"

namespace hapticd::study {

/// A palpation of a simulated object as the encoders and the sensor show it, and the truth to judge by.
struct TruePalpation {
  std::vector<identification::PalpationSample> samples;
  std::vector<double> true_displacement_mm;
};

/// A request each, done one after the other on phantom_1_5_high_force without any force of the device.
TruePalpation palpate(const std::string& object, const std::vector<identification::MotionRequest>& requests,
                      std::uint64_t seed);

/// Presses as a hand mixes them, unlike any an identification asks for: what laws are judged by.
const std::vector<identification::MotionRequest>& validation_requests();

/// What a law makes of a palpation it was not fitted to.
struct ContactErrors {
  double force = 0.0;            ///< mean |f̂ - f| over mean f, in contact
  double force_by_sample = 0.0;  ///< mean |f̂ - f|/f where f > 0.2 N
  double displacement = 0.0;     ///< mean |x̂/x - 1| beyond a tenth of the deepest, x the truth
  double displacement_median = 0.0;
};
ContactErrors errors_of(const rt::HuntCrossleyParameters& law, const TruePalpation& palpation);
ContactErrors errors_of(const rt::CreepParameters& law, const TruePalpation& palpation);

/// The force a law predicts at every sample in contact; NaN elsewhere.
std::vector<double> predicted_force_n(const rt::HuntCrossleyParameters& law,
                                      const std::vector<identification::PalpationSample>& palpation);
std::vector<double> predicted_force_n(const rt::CreepParameters& law,
                                      const std::vector<identification::PalpationSample>& palpation);

}  // namespace hapticd::study
