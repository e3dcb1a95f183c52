#pragma once

#include <string>

#include "hal/openhaptics/openhaptics_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads the keys of a device reached through the vendor's library; what is wrong is reported by the
/// document.
void read_openhaptics(TomlTable table, openhaptics::OpenHapticsConfig& config);
/// Writes the keys without the table's name, every default written out; reads back as the same. A limit that
/// is the device's to report has no default and is left out unless it is set.
std::string write_openhaptics(const openhaptics::OpenHapticsConfig& config);

}  // namespace hapticd::server
