#pragma once

#include <string>

#include "server/toml_reader.h"
#include "server/turntable/turntable_config.h"

namespace hapticd::server {

/// Reads [rig.turntable]; what is wrong is told by the document.
void read_turntable(TomlTable table, TurntableConfig& config);
/// The section, every default written out; reads back as the same.
std::string write_turntable(const TurntableConfig& config);

}  // namespace hapticd::server
