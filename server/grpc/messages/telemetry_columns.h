#pragma once

#include <span>

#include "server/telemetry/telemetry_column.h"

namespace hapticd::server {

/// All columns of a telemetry block and of a recording, in the order of the groups.
std::span<const TelemetryColumn> telemetry_columns() noexcept;

}  // namespace hapticd::server
