#pragma once

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/loading/loading_trial.h"

namespace hapticd::study {

/// How a contact begins to be felt.
struct OnsetOutcome {
  std::string failed;     ///< why there is no figure; empty = there is
  double force_n = 0.0;   ///< true reaction of the object when the device gives its first force
  double depth_mm = 0.0;  ///< true displacement then
  /// Steepest slope of the hand's force over 0.3 mm, over the target's, or over the object's if that is
  /// stiffer.
  double slope_ratio = 0.0;
  std::vector<LoadingPoint> first;  ///< the first two millimetres
};

/// The hand comes from the air along a minimum-jerk course that meets the surface with `speed_mm_per_s`, its
/// highest speed, and goes on as deep as it came. Force and displacement are the simulation's truth.
OnsetOutcome meet(const LoadingTrial& trial, double speed_mm_per_s);

/// Onset of the same press, live over the vendor's library and a Net F/T box, with a late scheduler; at most
/// three times, if the machine stalled.
OnsetOutcome meet_live(const LoadingTrial& trial, double speed_mm_per_s);

/// The slope ratio of the same hand that meets a real object of the target's stiffness, elastic and linear,
/// with the same device, whose motors give nothing: the device's own mass and friction are in every slope.
double slope_ratio_of_real(const LoadingTrial& trial, double speed_mm_per_s);

}  // namespace hapticd::study
