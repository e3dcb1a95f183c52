#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "hal/recording/block.h"
#include "server/telemetry/telemetry_column.h"

namespace hapticd::server {

/// The columns that are recorded, and rows of them.
class ColumnTable {
 public:
  /// Table of the columns of these groups (bits of rt::channel), after "tick", "time_ns" and
  /// "scene_generation".
  ColumnTable(std::span<const TelemetryColumn> all, std::uint32_t channels);

  const std::vector<recording::Column>& columns() const { return columns_; }
  std::size_t row_bytes() const { return columns_.size() * recording::kCellBytes; }
  /// Appends a row. The cells of a group that the record lacks are NaN.
  void append_row(const rt::TickRecord& record, std::string& rows) const;

 private:
  std::vector<TelemetryColumn> chosen_;
  std::vector<recording::Column> columns_;
};

}  // namespace hapticd::server
