#pragma once

#include <vector>

#include "server/identification/session/identification.h"

namespace hapticd::identification {

/// Cell of a plane of conditions that a kind waits for, and what to do for it.
struct RequiredCell {
  int x = 0, y = 0;
  const char* words = "";
};

/// Plane of conditions that a motion visits; one axis alone if `y` has no bins.
struct CoveragePlan {
  Coverage::Axis x, y;
  std::vector<RequiredCell> required;  ///< in the order in which they are asked for
  double enough_s = 0.0;               ///< of samples in a required cell
};

/// Table of a kind of identification: what it asks for and says that does not depend on the data.
struct Kind {
  const char* place;  ///< of its errors
  const char *fit_x, *fit_y;
  std::vector<CoveragePlan> coverage = {};
  std::vector<MotionRequest> motions = {};  ///< asked for in turn until it has converged
  const char* remedy_of_bad_model =
      nullptr;  ///< of a result that no model may have; none = that of the check
};

const Kind& contact_kind();
const Kind& friction_kind();
const Kind& gains_kind();
const Kind& inclusion_kind();
const Kind& structural_kind();
const Kind& threshold_kind();
const Kind& tool_kind();

}  // namespace hapticd::identification
