#pragma once

#include <string>

#include "hapticd/v1/rendering.pb.h"

namespace hapticd::cli {

/// "linear, 0.5 N/mm", "Hunt-Crossley, K 0.05, B 0.001, M 1.6"; a profile with its knots, as `target set`
/// takes them. "unknown" for a kind that this client does not know.
std::string target_words(const v1::TargetLaw& law);

}  // namespace hapticd::cli
