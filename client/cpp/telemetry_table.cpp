#include "client/cpp/telemetry_table.h"

#include <bit>

#include "client/cpp/error.h"

namespace hapticd::client {

namespace {

constexpr std::size_t kCellBytes = 8;

[[noreturn]] void refuse(const std::string& what) {
  v1::ErrorDetail detail;
  detail.set_what("a block of telemetry cannot be read: " + what);
  throw Error(ErrorKind::kUnreadable, "", detail);
}

}  // namespace

void TelemetryTable::set(const v1::TelemetryBlock& block) {
  if (columns_.empty()) {
    if (block.columns().empty()) refuse("it has no columns, and none came before");
    for (const v1::TelemetryColumn& column : block.columns()) {
      if (column.type() != v1::COLUMN_TYPE_FLOAT64 && column.type() != v1::COLUMN_TYPE_INT64)
        refuse("column '" + column.name() + "' has a type that this client does not know");
    }
    columns_.assign(block.columns().begin(), block.columns().end());
  } else if (!block.columns().empty() && static_cast<std::size_t>(block.columns_size()) != columns_.size()) {
    refuse("its columns are others than those of the stream");
  }
  const std::size_t row_bytes = kCellBytes * columns_.size();
  if (block.rows().size() % row_bytes != 0) {
    refuse(std::to_string(block.rows().size()) + " bytes are no multiple of a row's " +
           std::to_string(row_bytes));
  }
  cells_ = block.rows();
  rows_ = cells_.size() / row_bytes;
}

std::optional<std::size_t> TelemetryTable::column(std::string_view name) const noexcept {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].name() == name) return i;
  }
  return std::nullopt;
}

std::uint64_t TelemetryTable::cell(std::size_t row, std::size_t column) const noexcept {
  const std::size_t at = kCellBytes * (row * columns_.size() + column);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < kCellBytes; ++i) {  // compilers make one load of it if bytes are in this order
    bits |= static_cast<std::uint64_t>(static_cast<unsigned char>(cells_[at + i])) << (8 * i);
  }
  return bits;
}

std::int64_t TelemetryTable::integer(std::size_t row, std::size_t column) const noexcept {
  return static_cast<std::int64_t>(cell(row, column));
}

double TelemetryTable::number(std::size_t row, std::size_t column) const noexcept {
  if (columns_[column].type() == v1::COLUMN_TYPE_INT64) return static_cast<double>(integer(row, column));
  return std::bit_cast<double>(cell(row, column));
}

}  // namespace hapticd::client
