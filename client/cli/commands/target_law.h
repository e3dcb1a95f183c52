#pragma once

#include <string>

#include "hapticd/v1/rendering.pb.h"

namespace hapticd::cli {

// Target laws as they are written on the command line. Each throws LocalError with the option and what it
// takes. The daemon checks the numbers.

/// "K,B,M": stiffness in N/mm^m, damping in N·s/mm^(m+1), exponent.
v1::HuntCrossleyLaw parse_hunt_crossley(const std::string& text);
/// "MM:N_PER_MM,…", e.g. "0:0.2,5:0.8"; `option` is what errors call it.
v1::StiffnessProfile parse_profile(const std::string& text, const std::string& option);
/// "x", "y", "z" or "X,Y,Z".
v1::Vector3 parse_axis(const std::string& text);

}  // namespace hapticd::cli
