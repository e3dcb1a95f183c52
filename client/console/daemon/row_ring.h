#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hapticd::console {

/// The last rows of a table of numbers, for readers that come at their own pace. One thread.
class RowRing {
 public:
  /// `columns` and `rows` at least 1.
  RowRing(std::size_t columns, std::size_t rows);

  std::size_t columns() const { return columns_; }
  /// `row`: one value for each column.
  void add(std::span<const double> row);
  /// Number of the row that comes next, counted from 0 since the beginning.
  std::uint64_t end() const { return end_; }
  /// Number of the oldest row that is still here.
  std::uint64_t begin() const;
  /// A row from begin() to before end().
  std::span<const double> row(std::uint64_t number) const;

 private:
  const std::size_t columns_;
  const std::size_t rows_;
  std::vector<double> values_;
  std::uint64_t end_ = 0;
};

/// Position of a reader, and what it has missed since it began.
struct RowReader {
  std::vector<std::size_t> columns;  ///< of the ring, in the reader's order
  std::uint64_t next = 0;            ///< number of the row it reads next
  std::uint64_t lost = 0;            ///< rows that it never saw, not even in a pair
  std::uint64_t merged = 0;          ///< rows that it saw as part of a pair
};

/// All rows since the reader read last, as numbers: `id`, rows, samples for each row, lost, merged, then row
/// by row. If that would be more than `max_rows` rows, each pair of rows has the minima and the maxima of
/// "samples for each row" times two rows; of a column that only rises, these are the first and the last
/// value. What the ring no longer has is counted as lost. NaN counts as no value; a column of NaN alone stays
/// NaN.
std::vector<double> read_rows(const RowRing& ring, RowReader& reader, double id, std::size_t max_rows);

inline constexpr std::size_t kFrameHeader = 5;

}  // namespace hapticd::console
