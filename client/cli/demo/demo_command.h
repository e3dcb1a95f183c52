#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/session/session.h"

namespace hapticd::cli {

/// Adds the command `demo` to `app`, and has it run on `session`; both must outlive the parsing.
void add_demo_command(CLI::App& app, Session& session);

}  // namespace hapticd::cli
