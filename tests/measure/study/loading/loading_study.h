#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/loading/loading_trial.h"

namespace hapticd::study {

/// A press of the study, all but its rate.
struct LoadingCase {
  std::string device;
  std::string object;
  int dims = 1;  ///< 1: tap_1d, 3: explore_bearing
  double target_n_per_mm = 0.0;

  LoadingTrial trial(double rate_n_per_s) const;
};

/// Both devices, one and three dimensions, the objects of D§3 and of D§4 at two targets; few of them if
/// `quick`.
std::vector<LoadingCase> loading_cases(bool quick);

/// press(), with a fifth less force each time that device or sensor cannot do it, down to 0.5 N; sets the
/// trial's force to what was pressed with.
LoadingOutcome press_as_feasible(LoadingTrial& trial);

/// Takes all compensation out of a scene: of the loop's delay and of the device's own friction.
void leave_uncompensated(rt::SceneSpec& scene);

}  // namespace hapticd::study
