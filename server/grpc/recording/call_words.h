#pragma once

#include <string>
#include <string_view>

namespace hapticd::server {

/// Words of a call as people read it: "set hand program: program (kind rest, force_n 2)" for
/// "SimulationService/SetHandProgram" with the arguments of the audit log, a message in protobuf's text
/// format on one line. Words in quotes stay as they are.
std::string words_of_call(std::string_view method, std::string_view arguments);

}  // namespace hapticd::server
