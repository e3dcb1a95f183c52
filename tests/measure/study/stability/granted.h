#pragma once

#include <string>
#include <vector>

#include "tests/measure/study/stability/stability_trial.h"

namespace hapticd::study {

/// A rig that is other than the scene takes it to be.
struct GrantedCase {
  std::string device;
  double object_n_per_mm = 1.0;
  double mode_hz = 100.0;        ///< of the structure
  std::string delay = "none";    ///< "sensor" or "encoders": its samples are 2 ms late, and it is not said
  bool is_late = false;          ///< a fifth of the ticks, by 1 ms
  double structure_scale = 1.0;  ///< its stiffness over what the rig states
};

std::vector<GrantedCase> granted_cases(bool quick);
/// `tap_1d` as it is shipped, with the largest target that it grants there.
StabilityTrial granted_trial(const GrantedCase& c);

}  // namespace hapticd::study
