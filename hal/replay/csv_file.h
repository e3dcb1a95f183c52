#pragma once

#include <cstddef>
#include <fstream>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/error.h"

namespace hapticd::replay {

/// A numeric CSV file, read once from front to back: one header line with the column names, then rows of
/// numbers separated by commas. Empty lines and lines that begin with '#' are skipped anywhere; blanks
/// around a cell, CRLF line ends and a UTF-8 byte order mark are accepted. Everything else is refused with
/// the line and the column: quoted fields, empty cells, NaN, infinities, rows longer or shorter than the
/// header. Needs memory for one line only, whatever the size of the file.
class CsvFile {
 public:
  static constexpr std::size_t kMaxLineBytes = 65'536;
  static constexpr std::size_t kMaxRows = 10'000'000;

  /// Called for each row with its line in the file (from 1) and the requested cells. An error ends the
  /// reading.
  using RowVisitor =
      std::function<std::optional<hal::Error>(std::size_t line, std::span<const double> cells)>;

  /// Opens the file and reads its header.
  static hal::Result<CsvFile> open(const std::string& path);

  const std::vector<std::string>& columns() const noexcept { return columns_; }
  /// "recording 'PATH'", with the line where one is given; for errors.
  std::string place(std::size_t line = 0) const;

  /// Reads all rows. Only the cells of `columns` (indices into columns(), in any order) are parsed and
  /// passed on; the others may hold text. Call it once.
  std::optional<hal::Error> read_rows(std::span<const std::size_t> columns, const RowVisitor& visit);

 private:
  explicit CsvFile(std::string path) : path_(std::move(path)), buffer_(kMaxLineBytes) {}

  enum class LineState : unsigned char { kLine, kEnd, kFailed };
  LineState next_line(std::string_view& text, std::optional<hal::Error>& error);
  std::optional<hal::Error> parse_cell(std::string_view text, std::size_t column, double& number) const;

  std::string path_;
  std::ifstream stream_;
  std::vector<char> buffer_;
  std::size_t line_ = 0;
  std::vector<std::string> columns_;
};

}  // namespace hapticd::replay
