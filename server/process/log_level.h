#pragma once

#include <cstdint>

namespace hapticd::server {

enum class LogLevel : std::uint8_t { kDebug, kInfo, kWarning, kError, kOff };

}  // namespace hapticd::server
