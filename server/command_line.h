#pragma once

#include <optional>
#include <string>

#include "server/config/config.h"

namespace hapticd::server {

/// The options of the command line.
struct CommandLine {
  std::string config_file;  ///< empty = none
  ConfigOverrides overrides;
  bool check_config = false;
};

/// Reads the command line. If the process has nothing more to do (help, version, an error) the text is
/// printed and nothing is returned; `exit_code` is then that of the process.
std::optional<CommandLine> read_command_line(int argc, char** argv, int& exit_code);

}  // namespace hapticd::server
