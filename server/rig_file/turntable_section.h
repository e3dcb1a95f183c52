#pragma once

#include <string>

#include "server/rig_file/turntable_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads [rig.turntable]; what is wrong is reported by the document.
void read_turntable(TomlTable table, TurntableConfig& config);
/// Writes the section with every default; reads back as the same.
std::string write_turntable(const TurntableConfig& config);

}  // namespace hapticd::server
