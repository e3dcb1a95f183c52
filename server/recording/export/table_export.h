#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/recording/mcap_reader.h"

namespace hapticd::server {

enum class TableFormat : std::uint8_t { kHdf5, kCsv };

struct ExportRequest {
  std::string input;   ///< a recording: MCAP, or the table of one as HDF5, without its events and metadata
  std::string output;  ///< replaced if it is there
  TableFormat format = TableFormat::kHdf5;
  std::vector<std::string> columns;  ///< empty = all; "tick" and the time are always written
  double from_s = 0.0;               ///< after the first row
  double to_s = 0.0;                 ///< 0 = to the end
  std::uint32_t decimation = 1;      ///< every n-th row
  recording::Links links = recording::Links::kFollowed;  ///< at the end of `input`
};

/// Writes a recording as a table. Errors: a column that it does not have (those that it has are named), no
/// row in the span, no recording, a file that cannot be written.
std::optional<hal::Error> export_table(const ExportRequest& request);

}  // namespace hapticd::server
