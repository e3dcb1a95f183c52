#pragma once

#include <cstdint>

#include "rt/record/tick_record.h"

namespace hapticd::server {

/// A column of telemetry as a table: one number of a group of v1::TelemetrySample, named as `hapticctl
/// telemetry record` names it.
struct TelemetryColumn {
  const char* name;       ///< group_quantity_unit, e.g. "contact_reaction_force_n"
  const char* unit;       ///< "1" if it has none
  std::uint32_t channel;  ///< bit of rt::channel: if a record lacks it, the cell is NaN
  double (*value)(const rt::TickRecord& record);
};

}  // namespace hapticd::server
