#pragma once

#include <string>
#include <vector>

#include "hal/replay/column_mapping.h"

namespace hapticd::server {

/// Fills in the column of a quantity that was not named, if hapticd wrote the file: `hapticctl telemetry
/// record`, or an identification that kept its data. `mapping` is as the user gave it. It is not changed if
/// it names a column or unit, if a column has one of the role's names, and in files of other programs. A
/// press is along -z, as in all one-dimensional recordings, so the sign of the position is changed. True if a
/// column was filled in.
bool fill_own_column(replay::ColumnMapping& mapping, const replay::ColumnRole& role,
                     const std::vector<std::string>& columns);

/// True if a file has columns that only hapticd writes: its positions are those of a device's encoders.
bool is_own_recording(const std::vector<std::string>& columns);

}  // namespace hapticd::server
