#pragma once

#include <string>

#include "hapticd/v1/access.pb.h"

namespace hapticd::cli {

/// Words on who controls the rig, and who is about to take it: a line each.
std::string lease_words(const v1::LeaseState& state);

}  // namespace hapticd::cli
