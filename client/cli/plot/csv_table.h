#pragma once

#include <map>
#include <string>
#include <vector>

namespace hapticd::cli {

/// Numbers of a CSV file with a line of column names; lines beginning with '#' are comments. A cell that is
/// not a number (empty, or a word) is NaN.
class CsvTable {
 public:
  /// Throws LocalError naming the file and the line: no columns, no rows, or a row with too few or too many
  /// cells.
  static CsvTable read(const std::string& path) { return read(path, path); }
  /// `shown_as`: the file that the table is of, where `path` is a copy of it.
  static CsvTable read(const std::string& path, const std::string& shown_as);

  bool has(const std::string& column) const { return columns_.contains(column); }
  /// Throws LocalError naming the column that is missing.
  const std::vector<double>& column(const std::string& name) const;
  std::size_t rows() const noexcept { return rows_; }
  const std::string& path() const noexcept { return path_; }

 private:
  std::string path_;
  std::map<std::string, std::vector<double>> columns_;
  std::size_t rows_ = 0;
};

}  // namespace hapticd::cli
