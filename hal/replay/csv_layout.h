#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hal/shown_text.h"

namespace hapticd::replay {

/// A line that is neither empty nor a comment, with its number in the file.
struct CsvLine {
  std::size_t number = 0;
  std::string text;
};

/// How the table in a CSV file is laid out.
struct CsvLayout {
  char separator = ',';  ///< or ';' or a tab
  /// Names of the columns. A unit from a row of units under the header follows the name in brackets: "Load
  /// [kN]".
  std::vector<std::string> columns;
  std::size_t header_line = 0;
  std::size_t last_line_before_rows = 0;  ///< the header, or the row of units under it
};

/// Finds the table from a file's first lines: the first line of names that rows of numbers follow, after any
/// preamble, with or without a row of units in between. If there is none, the first line counts as the
/// header, so that an error can name what is wrong with the rows. Needs at least one line.
CsvLayout find_layout(std::span<const CsvLine> lines);

/// True if a cell could be a number, with a point or a comma.
bool is_like_number(std::string_view cell);

/// Calls `take(index, cell)` for each cell, without blanks and quotation marks around it; returns their
/// number. A separator between quotation marks separates nothing. Two quotation marks for one stay two.
template <class Take>
std::size_t split_cells(std::string_view text, char separator, const Take& take) {
  for (std::size_t index = 0;; ++index) {
    std::size_t from = text.find_first_not_of(separator == '\t' ? " " : " \t");
    const bool is_quoted = from != std::string_view::npos && text[from] == '"';
    std::size_t closing = std::string_view::npos;
    if (is_quoted) {
      closing = text.find('"', from + 1);
      while (closing != std::string_view::npos && text.substr(closing + 1).starts_with('"'))
        closing = text.find('"', closing + 2);
    }
    const bool is_closed = closing != std::string_view::npos;
    const std::size_t end = text.find(separator, is_closed ? closing : 0);
    std::string_view cell = hal::trimmed(text.substr(0, end));
    if (is_closed && cell.size() >= 2 && cell.back() == '"')
      cell = hal::trimmed(cell.substr(1, cell.size() - 2));
    take(index, cell);
    if (end == std::string_view::npos) return index + 1;
    text.remove_prefix(end + 1);
  }
}

}  // namespace hapticd::replay
