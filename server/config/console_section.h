#pragma once

#include <string>

#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Programs that may call on behalf of others: [console]. The page itself is a separate program,
/// hapticd-console, with its own configuration.
struct ConsoleConfig {
  /// [console] user: its connections over the unix socket may, next to those of the daemon's own user. A user
  /// that does not exist, or an empty text: only the latter.
  std::string user = "hapticd-console";
};

void read_console(TomlTable table, ConsoleConfig& console);
/// Writes the section with every default; reads back as the same.
std::string write_console(const ConsoleConfig& console);

}  // namespace hapticd::server
