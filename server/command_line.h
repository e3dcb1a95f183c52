#pragma once

#include <optional>
#include <string>

#include "server/config/config.h"

namespace hapticd::server {

/// What the command line asks for.
struct CommandLine {
  std::string config_file;  ///< empty = none
  ConfigOverrides overrides;
  bool check_config = false;
};

/// Reads the command line. Where the process has nothing more to do (help, version, a mistake) it has printed
/// what there is to say and returns nothing; `exit_code` is then the process's.
std::optional<CommandLine> read_command_line(int argc, char** argv, int& exit_code);

}  // namespace hapticd::server
