#pragma once

#include <string>

#include "hal/netft/netft_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads the keys of a Net F/T box; see hal/netft/README.md. Absent keys change nothing.
void read_netft(TomlTable table, netft::NetFtConfig& config);

/// Writes all keys with every default, without the header of the table; reads back as the same. An expected
/// filter is written only if there is one.
std::string write_netft(const netft::NetFtConfig& config);

}  // namespace hapticd::server
