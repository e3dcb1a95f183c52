#include "client/console/daemon/row_ring.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hapticd::console {

RowRing::RowRing(std::size_t columns, std::size_t rows)
    : columns_(columns), rows_(rows), values_(columns * rows) {}

void RowRing::add(std::span<const double> row) {
  const std::size_t place = static_cast<std::size_t>(end_ % rows_) * columns_;
  std::copy_n(row.begin(), columns_, values_.begin() + static_cast<std::ptrdiff_t>(place));
  ++end_;
}

std::uint64_t RowRing::begin() const {
  return end_ > rows_ ? end_ - rows_ : 0;
}

std::span<const double> RowRing::row(std::uint64_t number) const {
  return std::span(values_).subspan(static_cast<std::size_t>(number % rows_) * columns_, columns_);
}

namespace {

/// Appends two rows: the minima and the maxima of rows `from` to before `to`.
void append_pair(const RowRing& ring, const std::vector<std::size_t>& columns, std::uint64_t from,
                 std::uint64_t to, std::vector<double>& out) {
  const std::size_t place = out.size();
  const std::size_t width = columns.size();
  out.resize(place + 2 * width, std::numeric_limits<double>::quiet_NaN());
  for (std::uint64_t number = from; number < to; ++number) {
    const auto row = ring.row(number);
    for (std::size_t i = 0; i < width; ++i) {
      const double value = row[columns[i]];
      double& least = out[place + i];
      double& most = out[place + width + i];
      // As fmin() and fmax(), which pass over NaN, but are calls.
      if (value < least || std::isnan(least)) least = value;
      if (value > most || std::isnan(most)) most = value;
    }
  }
}

}  // namespace

std::vector<double> read_rows(const RowRing& ring, RowReader& reader, double id, std::size_t max_rows) {
  if (reader.next < ring.begin()) {
    reader.lost += ring.begin() - reader.next;
    reader.next = ring.begin();
  }
  const std::uint64_t count = ring.end() - reader.next;
  std::vector<double> out(kFrameHeader);
  std::uint64_t samples = 1;  // for each row
  if (count <= max_rows) {
    out.reserve(kFrameHeader + static_cast<std::size_t>(count) * reader.columns.size());
    for (; reader.next < ring.end(); ++reader.next) {
      const auto row = ring.row(reader.next);
      for (const std::size_t column : reader.columns) out.push_back(row[column]);
    }
  } else {
    const std::uint64_t pairs = std::max<std::uint64_t>(max_rows / 2, 1);
    const std::uint64_t bin = (count + pairs - 1) / pairs;  // at least 2
    samples = (bin + 1) / 2;
    reader.merged += count;
    while (reader.next < ring.end()) {
      const std::uint64_t to = std::min(reader.next + bin, ring.end());
      append_pair(ring, reader.columns, reader.next, to, out);
      reader.next = to;
    }
  }
  const std::size_t rows = (out.size() - kFrameHeader) / std::max<std::size_t>(reader.columns.size(), 1);
  out[0] = id;
  out[1] = static_cast<double>(rows);
  out[2] = static_cast<double>(samples);
  out[3] = static_cast<double>(reader.lost);
  out[4] = static_cast<double>(reader.merged);
  return out;
}

}  // namespace hapticd::console
