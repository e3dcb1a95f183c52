#pragma once

#include <string_view>

#include "server/process/log_level.h"

namespace hapticd::server {

/// Sets the level of the log. Each function below writes one line to standard error. Never called by the
/// loop.
void set_log_level(LogLevel level);
void log_debug(std::string_view line);
void log_info(std::string_view line);
void log_warning(std::string_view line);
void log_error(std::string_view line);

}  // namespace hapticd::server
