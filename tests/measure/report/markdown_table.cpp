#include "tests/measure/report/markdown_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string_view>

namespace hapticd::report {
namespace {

/// Characters, not bytes: "µm" is as wide as "mm".
std::size_t width(std::string_view text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

bool looks_numeric(std::string_view cell) {
  if (cell.empty() || cell == kNoNumber) return true;
  const std::size_t sign = cell.front() == '-' || cell.front() == '+' ? 1 : 0;
  return cell.size() > sign && cell[sign] >= '0' && cell[sign] <= '9';
}

std::string cleaned(std::string_view cell) {
  std::string clean;
  for (const char c : cell) {
    if (c == '|') {
      clean += "\\|";
    } else {
      clean += c == '\n' || c == '\r' ? ' ' : c;
    }
  }
  return clean;
}

}  // namespace

MarkdownTable::MarkdownTable(std::vector<std::string> headers) : headers_(std::move(headers)) {
  for (std::string& header : headers_) header = cleaned(header);
}

void MarkdownTable::add_row(std::vector<std::string> cells) {
  if (cells.size() != headers_.size()) throw std::invalid_argument("a table row needs one cell a column");
  for (std::string& cell : cells) cell = cleaned(cell);
  rows_.push_back(std::move(cells));
}

std::string MarkdownTable::text() const {
  const std::size_t columns = headers_.size();
  std::vector<std::size_t> widths(columns);
  std::vector<bool> right(columns, true);
  for (std::size_t i = 0; i < columns; ++i) {
    widths[i] = std::max<std::size_t>(width(headers_[i]), 3);
    for (const auto& row : rows_) {
      widths[i] = std::max(widths[i], width(row[i]));
      right[i] = right[i] && looks_numeric(row[i]);
    }
  }
  std::string text;
  const auto add_line = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < columns; ++i) {
      const std::string padding(widths[i] - width(cells[i]), ' ');
      text += "| " + (right[i] ? padding + cells[i] : cells[i] + padding) + " ";
    }
    text += "|\n";
  };
  add_line(headers_);
  for (std::size_t i = 0; i < columns; ++i) {
    text += "|" + std::string(widths[i] + (right[i] ? 1 : 2), '-') + (right[i] ? ":" : "");
  }
  text += "|\n";
  for (const auto& row : rows_) add_line(row);
  return text;
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return kNoNumber;
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string significant(double value, int digits) {
  if (!std::isfinite(value)) return kNoNumber;
  if (value == 0.0) return "0";
  // Digits of the rounded value: 9.996 to three digits is 10.0, not 10.00.
  const double rounding = 0.5 * std::pow(10.0, std::floor(std::log10(std::abs(value))) - digits + 1);
  const int magnitude = static_cast<int>(std::floor(std::log10(std::abs(value) + rounding)));
  if (magnitude < -6 || magnitude > 9) {
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%.*e", digits - 1, value);
    return text.data();
  }
  return fixed(value, std::max(0, digits - 1 - magnitude));
}

}  // namespace hapticd::report
