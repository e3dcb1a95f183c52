#pragma once

#include <string>

#include "hal/phantom/phantom_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads a PHANToM on [rig.board]. `model` names the preset that the other keys change.
void read_phantom(TomlTable table, phantom::PhantomConfig& config);
/// Writes every key with its value, without the table's header; reads back as the same.
std::string write_phantom(const phantom::PhantomConfig& config);

}  // namespace hapticd::server
