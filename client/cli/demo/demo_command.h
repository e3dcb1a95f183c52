#pragma once

#include "client/cli/session/session.h"

namespace CLI {
class App;
}

namespace hapticd::cli {

/// Adds the command `demo` to `app`, and has it run on `session`; both must outlive the parsing.
void add_demo_command(CLI::App& app, Session& session);

}  // namespace hapticd::cli
