#pragma once

#include <string>

#include "server/config/access_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads [access].
void read_access(TomlTable table, AccessConfig& access);
/// Writes the section with every default; reads back as the same.
std::string write_access(const AccessConfig& access);

}  // namespace hapticd::server
