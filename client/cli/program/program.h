#pragma once

#include "client/cli/session/session.h"

namespace CLI {
class App;
}

namespace hapticd::cli {

/// Adds the options that every command takes, and asks for one command.
void add_global_options(CLI::App& app, Session& session);

/// main() of a program with the options and commands that `build` adds: runs what the command line names,
/// reports what failed, and returns the exit code.
int run_program(int argc, char** argv, void (*build)(CLI::App& app, Session& session));

}  // namespace hapticd::cli
