#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "hal/modbus/register_map.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Parses a register map from TOML text; `source` names it in errors. Unknown keys, unknown registers and
/// contradictions are errors.
hal::Result<modbus::RegisterMap> parse_turntable_map(std::string_view text, std::string name,
                                                     std::string source);
/// Finds a map by the name of a built-in one, or by the path of a file (with a '/' in it, or ending in
/// .toml).
hal::Result<modbus::RegisterMap> find_turntable_map(const std::string& name_or_path);
/// Names of the built-in maps, sorted.
std::vector<std::string> turntable_map_names();

/// Reads a map from a table of a larger document. What a line is to blame for is reported by the document;
/// the rest, returned.
std::optional<hal::Error> read_turntable_map(TomlTable table, modbus::RegisterMap& map);
/// Writes TOML that reads back as the same; `prefix` is the table's dotted name, empty for a separate
/// document.
std::string write_turntable_map(const modbus::RegisterMap& map, std::string_view prefix);

}  // namespace hapticd::server
