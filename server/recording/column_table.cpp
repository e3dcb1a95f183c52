#include "server/recording/column_table.h"

#include <cstring>
#include <limits>

namespace hapticd::server {

namespace {

template <class T>
void put_cell(T value, char*& cell) {
  static_assert(sizeof(T) == recording::kCellBytes);
  std::memcpy(cell, &value, sizeof(T));
  cell += sizeof(T);
}

}  // namespace

ColumnTable::ColumnTable(std::span<const TelemetryColumn> all, std::uint32_t channels)
    : columns_{{"tick", "1", true}, {"time_ns", "ns", true}, {"scene_generation", "1", true}} {
  for (const TelemetryColumn& column : all) {
    if ((column.channel & channels) == 0) continue;
    chosen_.push_back(column);
    columns_.push_back({column.name, column.unit, false});
  }
}

void ColumnTable::append_row(const rt::TickRecord& record, std::string& rows) const {
  const std::size_t before = rows.size();
  rows.resize(before + row_bytes());
  char* cell = rows.data() + before;
  put_cell(static_cast<std::int64_t>(record.tick), cell);
  put_cell(record.time_ns, cell);
  put_cell(static_cast<std::int64_t>(record.scene_generation), cell);
  for (const TelemetryColumn& column : chosen_) {
    const bool is_there = (column.channel & record.channels) != 0;
    put_cell(is_there ? column.value(record) : std::numeric_limits<double>::quiet_NaN(), cell);
  }
}

}  // namespace hapticd::server
