#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/replay/csv_layout.h"
#include "hal/replay/text_lines.h"

namespace hapticd::replay {

/// Properties of a CSV file that its text does not show.
struct CsvFormat {
  bool decimal_comma = false;  ///< "0,015" is fifteen thousandths
};

/// A table of numbers as CSV, read once from front to back: of the daemon, or of a testing machine. There may
/// be a preamble before the line with the column names and a row of units below it; columns are separated by
/// commas, semicolons or tabs, and cells may be quoted (csv_layout.h, text_lines.h). Empty lines, and lines
/// that begin with '#', are skipped anywhere. A last row without a line end that is not complete was cut, and
/// is left out. Everything else is refused with the line and the column: empty cells, NaN, infinities, rows
/// longer or shorter than the header. Needs memory for the first lines only, whatever the size of the file.
class CsvFile {
 public:
  static constexpr std::size_t kMaxRows = 10'000'000;

  /// Called for each row with its line in the file (from 1) and the requested cells. An error ends the
  /// reading.
  using RowVisitor =
      std::function<std::optional<hal::Error>(std::size_t line, std::span<const double> cells)>;

  /// Opens the file and finds its table.
  static hal::Result<CsvFile> open(const std::string& path, const CsvFormat& format = {});

  const std::vector<std::string>& columns() const noexcept { return layout_.columns; }
  /// "recording 'PATH'", with the line if one is given; for errors.
  std::string place(std::size_t line = 0) const;

  /// Reads all rows. Only the cells of `columns` (indices into columns(), in any order) are parsed and
  /// passed on; the others may hold text. Call it once.
  std::optional<hal::Error> read_rows(std::span<const std::size_t> columns, const RowVisitor& visit);

 private:
  CsvFile(std::string path, const CsvFormat& format) : path_(std::move(path)), format_(format) {}

  std::optional<hal::Error> find_table();
  TextLines::State next_line(std::string_view& text, std::optional<hal::Error>& error);
  std::optional<hal::Error> parse_cell(std::string_view text, std::size_t column, double& number) const;
  hal::Error wrong_count(std::size_t count) const;

  std::string path_;
  CsvFormat format_;
  TextLines lines_;
  CsvLayout layout_;
};

}  // namespace hapticd::replay
