#include "client/cli/text/text_table.h"

#include <algorithm>
#include <utility>

#include "client/cli/session/print.h"

namespace hapticd::cli {
namespace {

/// A last column narrower than this is not broken: it would be unreadable.
constexpr std::size_t kMinBrokenColumns = 20;

}  // namespace

TextTable::TextTable(std::vector<std::string> headings, std::vector<Align> alignment)
    : headings_(std::move(headings)), alignment_(std::move(alignment)) {}

void TextTable::add(std::vector<std::string> row) {
  for (std::string& cell : row) cell = printable(cell);
  rows_.push_back(std::move(row));
}

std::vector<std::string> TextTable::lines(const Terminal& terminal, std::size_t indent) const {
  std::vector<std::size_t> widths;
  const auto widen = [&widths](const std::vector<std::string>& row) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], display_width(row[i]));
  };
  widen(headings_);
  for (const auto& row : rows_) widen(row);

  const auto line_of = [&](const std::vector<std::string>& row) {
    std::string line(indent, ' ');
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool right = i < alignment_.size() && alignment_[i] == Align::kRight;
      if (i > 0) line += "  ";
      line += right ? padded_left(row[i], widths[i]) : padded(row[i], widths[i]);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    return line;
  };
  std::vector<std::string> result;
  if (!headings_.empty()) result.push_back(terminal.bold(line_of(headings_)));
  std::size_t before_last = indent;
  for (std::size_t i = 0; i + 1 < widths.size(); ++i) before_last += widths[i] + 2;
  const auto room = static_cast<std::size_t>(terminal.width);
  const bool breaks = terminal.live && room >= before_last + kMinBrokenColumns;
  for (const auto& row : rows_) {
    if (!breaks || row.size() != widths.size() || before_last + display_width(row.back()) <= room) {
      result.push_back(line_of(row));
      continue;
    }
    auto part = row;
    for (std::string& piece : wrapped(row.back(), room - before_last)) {
      part.back() = std::move(piece);
      result.push_back(line_of(part));
      part.assign(row.size(), "");
    }
  }
  return result;
}

void TextTable::print(const Terminal& terminal, std::size_t indent) const {
  for (const auto& line : lines(terminal, indent)) print_line(line);
}

}  // namespace hapticd::cli
