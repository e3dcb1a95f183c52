#pragma once

#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// Rows of text in aligned columns, for people to read.
class TextTable {
 public:
  enum class Align { kLeft, kRight };

  /// `headings` may be empty: a table without a heading line. Columns beyond `alignment` are left-aligned.
  explicit TextTable(std::vector<std::string> headings = {}, std::vector<Align> alignment = {});

  /// Adds a row. Control characters in the cells are escaped.
  void add(std::vector<std::string> row);
  /// Lines without trailing blanks, indented by `indent` columns. On a terminal that is too narrow the last
  /// column is broken between words.
  std::vector<std::string> lines(const Terminal& terminal, std::size_t indent = 0) const;
  /// Prints to standard output.
  void print(const Terminal& terminal, std::size_t indent = 0) const;

 private:
  std::vector<std::string> headings_;
  std::vector<Align> alignment_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace hapticd::cli
