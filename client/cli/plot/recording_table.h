#pragma once

#include <string>

#include "client/cli/plot/csv_table.h"

namespace hapticd::cli {

/// The numbers of a recording of any kind that hapticd writes: CSV, MCAP, HDF5; its first bytes say which.
/// The last two become CSV by hapticd-export. Throws LocalError naming the file.
CsvTable read_recording(const std::string& path);

}  // namespace hapticd::cli
