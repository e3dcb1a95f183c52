#pragma once

#include <string>
#include <vector>

#include "client/cli/fleet/rigs_file.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Runs one command of this program on each rig, all at once, each in a separate process: a rig that does not
/// answer holds up no other, least of all a stop. Prints the answers in the order of the rigs, below their
/// names; with --json as one object. The session's exit code is the worst of all.
void run_on_rigs(const std::vector<ListedRig>& rigs, const std::vector<std::string>& command,
                 Session& session);

/// Runs a command on the rigs that --rigs named, of the file of rigs; false if --rigs was not given.
bool run_on_named_rigs(const std::vector<std::string>& command, Session& session);

}  // namespace hapticd::cli
