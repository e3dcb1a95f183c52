#pragma once

#include <string>

#include "server/config/watchdog_config.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads [watchdog].
void read_watchdog(TomlTable table, WatchdogConfig& watchdog);
/// Writes the section; reads back as the same.
std::string write_watchdog(const WatchdogConfig& watchdog);

}  // namespace hapticd::server
