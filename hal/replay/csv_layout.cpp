#include "hal/replay/csv_layout.h"

#include <algorithm>
#include <array>
#include <optional>

#include "hal/replay/units.h"

namespace hapticd::replay {
namespace {

constexpr std::array kSeparators{'\t', ';', ','};
constexpr std::size_t kMinNumbers = 2;

using Cells = std::vector<std::string_view>;

Cells cells_of(std::string_view text, char separator) {
  Cells cells;
  split_cells(text, separator, [&cells](std::size_t, std::string_view cell) { cells.push_back(cell); });
  return cells;
}

Cells without_empty_end(Cells cells) {
  while (!cells.empty() && cells.back().empty()) cells.pop_back();
  return cells;
}

bool has_number(const Cells& cells) {
  return std::ranges::any_of(cells, is_like_number);
}

/// True for a row of numbers under a header of so many names. Empty cells at its end may be left out or be
/// too many.
bool is_row(std::string_view text, char separator, std::size_t columns) {
  const Cells cells = cells_of(text, separator);
  return cells.size() >= columns && without_empty_end(cells).size() <= columns &&
         static_cast<std::size_t>(std::ranges::count_if(cells, is_like_number)) >= kMinNumbers;
}

std::string_view without_brackets(std::string_view unit) {
  const bool is_bracketed =
      unit.size() > 2 && std::string_view("([{<").find(unit.front()) != std::string_view::npos;
  return is_bracketed ? hal::trimmed(unit.substr(1, unit.size() - 2)) : unit;
}

bool is_row_of_units(const Cells& cells, std::size_t columns) {
  const Cells units = without_empty_end(cells);
  if (units.size() > columns || has_number(units)) return false;
  const auto named = std::ranges::count_if(units, [](std::string_view cell) { return !cell.empty(); });
  const auto known =
      std::ranges::count_if(units, [](std::string_view cell) { return is_unit(without_brackets(cell)); });
  return known >= 2 || (known == 1 && named == 1);
}

bool means_the_same(std::string_view unit, std::string_view other) {
  return std::ranges::any_of(
      std::array{Quantity::kTime, Quantity::kForce, Quantity::kPosition, Quantity::kTorque},
      [&](Quantity quantity) {
        const auto factor = unit_factor(quantity, unit);
        return factor && factor == unit_factor(quantity, other);
      });
}

std::string named_with_unit(std::string_view name, std::string_view unit) {
  if (unit.empty() || means_the_same(take_apart(name).unit, unit)) return std::string(name);
  return std::string(name) + " [" + std::string(unit) + "]";
}

/// Layout if line `at` is a header with at least `rows` rows of numbers below it.
std::optional<CsvLayout> layout_at(std::span<const CsvLine> lines, std::size_t at, char separator,
                                   std::size_t rows) {
  const Cells names = without_empty_end(cells_of(lines[at].text, separator));
  if (names.size() < 2 || has_number(names)) return std::nullopt;
  std::size_t first_row = at + 1;
  Cells units;
  if (first_row < lines.size()) {
    units = cells_of(lines[first_row].text, separator);
    if (is_row_of_units(units, names.size())) {
      ++first_row;
    } else {
      units.clear();
    }
  }
  if (first_row + rows > lines.size()) return std::nullopt;
  for (std::size_t row = first_row; row < first_row + rows; ++row) {
    if (!is_row(lines[row].text, separator, names.size())) return std::nullopt;
  }
  CsvLayout layout{.separator = separator,
                   .columns = {},
                   .header_line = lines[at].number,
                   .last_line_before_rows = lines[first_row - 1].number};
  for (std::size_t i = 0; i < names.size(); ++i)
    layout.columns.push_back(named_with_unit(names[i], i < units.size() ? without_brackets(units[i]) : ""));
  return layout;
}

}  // namespace

bool is_like_number(std::string_view cell) {
  return cell.find_first_of("0123456789") != std::string_view::npos &&
         cell.find_first_not_of("0123456789.,+-eE") == std::string_view::npos;
}

CsvLayout find_layout(std::span<const CsvLine> lines) {
  // Two rows first: a table of one row may be part of a preamble.
  for (const std::size_t rows : {2UL, 1UL}) {
    for (std::size_t at = 0; at < lines.size(); ++at) {
      for (const char separator : kSeparators) {
        if (auto layout = layout_at(lines, at, separator, rows)) return *layout;
      }
    }
  }
  const CsvLine& first = lines.front();
  CsvLayout layout{
      .separator = ',', .columns = {}, .header_line = first.number, .last_line_before_rows = first.number};
  for (const char separator : kSeparators) {
    const Cells names = cells_of(first.text, separator);
    if (names.size() > layout.columns.size()) {
      layout.columns.assign(names.begin(), names.end());
      layout.separator = separator;
    }
  }
  return layout;
}

}  // namespace hapticd::replay
