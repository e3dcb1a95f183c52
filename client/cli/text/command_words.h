#pragma once

#include <string>
#include <vector>

#include "hapticd/v1/common.pb.h"

namespace hapticd::cli {

/// Error as a user of hapticctl meets it: calls and values of the contract, which programs branch on, become
/// commands and words: "SceneService.LoadScene" "hapticctl scene load NAME", "POSE_FRAME_RIG" "rig",
/// "SetTargetRequest.stiffness_n_per_mm" "stiffness_n_per_mm". What has no command stays as it is.
v1::ErrorDetail in_command_words(v1::ErrorDetail detail);

/// The commands that it names.
std::vector<std::string> contract_commands();

}  // namespace hapticd::cli
