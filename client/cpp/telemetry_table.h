#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::client {

/// Reads the blocks of one telemetry stream (TELEMETRY_ENCODING_BLOCK) without decoding them: a table of
/// numbers, one row for each tick. Holds a copy of the newest block's rows. Use it from one thread.
class TelemetryTable {
 public:
  /// The next block of the stream; its columns are those of the first. Throws Error (kUnreadable) if a block
  /// does not fit them: a first one without columns, columns again, a type that is not known, part of a row.
  void set(const v1::TelemetryBlock& block);

  const std::vector<v1::TelemetryColumn>& columns() const noexcept { return columns_; }
  /// Number of a column; nothing if the stream does not have it.
  std::optional<std::size_t> column(std::string_view name) const noexcept;

  std::size_t rows() const noexcept { return rows_; }
  /// row < rows(), column < columns().size(). NaN: the group does not exist in the loaded scene. Whole
  /// numbers beyond 2^53 are rounded.
  double number(std::size_t row, std::size_t column) const noexcept;
  /// Number in a column of type INT64.
  std::int64_t integer(std::size_t row, std::size_t column) const noexcept;

 private:
  std::uint64_t cell(std::size_t row, std::size_t column) const noexcept;

  std::vector<v1::TelemetryColumn> columns_;
  std::string cells_;
  std::size_t rows_ = 0;
};

}  // namespace hapticd::client
