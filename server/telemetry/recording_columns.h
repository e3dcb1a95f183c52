#pragma once

#include <string>
#include <vector>

#include "hal/replay/column_mapping.h"

namespace hapticd::server {

/// Fills in the column of a quantity that nothing names, where the file is one of hapticd's own: written by
/// `hapticctl telemetry record`, or kept by an identification. `mapping` as its owner gave it; it stays as it
/// is where it says anything, where a column goes by one of the role's names, and in files of others. A press
/// is along -z, as everywhere in recordings of one dimension: the position is turned. True where a column was
/// filled in.
bool fill_own_column(replay::ColumnMapping& mapping, const replay::ColumnRole& role,
                     const std::vector<std::string>& columns);

}  // namespace hapticd::server
