#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// Strokes back and forth along x with a rod; what the hand feels is read off the truth.
struct FrictionTrial {
  std::string object;
  std::optional<rt::FrictionTarget> target{};
  std::optional<double> stiffness_n_per_mm{};  ///< none: the object as it is
  double force_n = 2.0;
  double speed_mm_per_s = 60.0;
  double stroke_mm = 30.0;
  double rate_hz = 1000.0;
  double seconds = 9.0;
};

struct FrictionOutcome {
  double hand_coefficient = 0.0;  ///< tangential over normal force at the hand, mean while sliding
  double real_coefficient = 0.0;  ///< the same of the object alone
  double scale = 0.0;             ///< tangential force at the hand over the object's, in steady sliding
  double whole_scale = 0.0;       ///< the same from the first sliding on, the fade at reversals included
  double presliding_error = 0.0;  ///< of the stiffness at reversals, hand over scaled object, less 1; median
  double chatter_n = 0.0;         ///< largest device force across the normal above 20 Hz after a reversal
  double real_chatter_n = 0.0;    ///< the same of the object's friction
  double slide_chatter_n = 0.0;   ///< the same, rms over all of the stroke
  double normal_swing_mm = 0.0;   ///< rms of the displacement above 10 Hz
  double stroked_n_per_mm = 0.0;  ///< force over displacement along the normal, mean
  double min_energy_mj = 0.0;     ///< of the passivity observer
  double damped_share = 0.0;      ///< ticks in which passivity control had to brake
  double bounded_share = 0.0;     ///< ticks in contact in which the target was bounded
  int reversals = 0;
  std::string failed;
};

FrictionOutcome run_trial(const FrictionTrial& trial);

}  // namespace hapticd::study
