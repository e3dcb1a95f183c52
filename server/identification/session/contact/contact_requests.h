#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/identification/session/contact/coverage_map.h"
#include "server/identification/session/identification.h"

namespace hapticd::identification {

/// State of a palpation, and what is still wanted of it.
struct PalpationNeeds {
  double force_n = 6.0;          ///< what presses shall reach
  double largest_force_n = 0.0;  ///< reached
  double displacement_mm = 0.0;  ///< required by name; 0 = what the force gives
  double deepest_mm = 0.0;       ///< reached
  bool hold_wanted = false;      ///< creep has to be seen
  double held_s = 0.0;           ///< longest rest under at least 40 % of the force
  double speed_mm_per_s = 0.0;   ///< the fastest required
  std::vector<MissingCoverage> coverage;
  bool steady = false;
  bool certain = false;
  std::string uncertain;  ///< in words
  std::uint32_t contacts = 0;
};

/// What is missing in words, the most wanted first; empty if nothing is.
std::vector<std::string> missing_in_words(const PalpationNeeds& needs);

/// Next press or tap: gently first, then to the full force with a rest, then what coverage lacks; in the end
/// other forces and rates, until the estimate is steady and certain.
MotionRequest next_palpation(const PalpationNeeds& needs);

}  // namespace hapticd::identification
