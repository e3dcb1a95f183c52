#pragma once

#include <string>

#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Starts hapticd-console for the user of this command, with the daemon of `session`, and returns the address
/// that opens it, once. It goes on by itself, and ends some seconds after its last page. Throws LocalError if
/// it does not start.
std::string start_console_program(const Session& session);

}  // namespace hapticd::cli
