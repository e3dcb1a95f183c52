#pragma once

#include <string>
#include <vector>

#include "hal/samples.h"
#include "rt/friction/friction_model.h"

namespace hapticd::study {

/// One tick of strokes for validation, resolved along the true normal, as D§4.4.1 resolves them.
struct FrictionInstant {
  double time_s = 0.0;
  double along_mm = 0.0;
  double slide_mm = 0.0;  ///< by the encoders, on the surface, since the tick before
  double speed_mm_per_s = 0.0;
  double normal_n = 0.0;             ///< by the sensor
  double measured_friction_n = 0.0;  ///< by the sensor, against motion along the line
  double true_friction_n = 0.0;
  hal::Vector3 true_normal;
  hal::Vector3 tip_mm;  ///< by the encoders
};

/// Strokes at forces and speeds the identification did not ask for, with another seed: 2, 4 and 2.5 N at up
/// to 60, 90 and 120 mm/s, over `length_mm` about the home. From the first stroke on.
std::vector<FrictionInstant> validation_strokes(const std::string& object, const std::string& tip,
                                                double length_mm);

/// How well a model predicts them. The tip counts as moving above 2 mm/s: held by friction at the turns of a
/// stroke it bends what it is on without the encoders seeing it, and no law of their motion can feel.
struct FrictionJudgement {
  double error = 0.0;  ///< mean |predicted - true| over mean |true| while it moves, turns included
  double error_at_rest_too = 0.0;  ///< the same over all instants
  double mean_of_ratios =
      0.0;  ///< mean of |predicted - true| / |true| where |true| is above a fifth of its mean
  double sliding_error = 0.0;  ///< as `error`, beyond 3 mm after each turn and above 10 mm/s
  std::vector<double> predicted_n;
};
/// Judges by Dahl's law in its exact form; the ball bearing's too, over its own short way of 0.05 mm. By
/// Maxwell-slip elements if the parameters have them.
FrictionJudgement judge_friction(const std::vector<FrictionInstant>& strokes,
                                 const rt::FrictionParameters& parameters);

}  // namespace hapticd::study
