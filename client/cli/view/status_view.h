#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/access.pb.h"
#include "hapticd/v1/rig.pb.h"

namespace hapticd::cli {

/// What is shown beyond the first screen.
struct StatusDetail {
  bool parts = false;  ///< how parts of the rig are reached and what they and the loop count
  bool rough = false;  ///< figures of the rig that are known only roughly
};

/// Rig, scene, guard and what is touched now; then parts and loop. Without details it fits 80 columns and 24
/// rows, guard and contact among the first; no line is broken within a word.
std::vector<std::string> status_lines(const v1::RigInfo& rig, const v1::RigState& state,
                                      const v1::LeaseState& lease, const StatusDetail& detail,
                                      const Terminal& terminal);

}  // namespace hapticd::cli
