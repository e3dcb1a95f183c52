#include "client/cli/identify/identify_coverage.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace hapticd::cli {
namespace {

constexpr std::size_t kCellColumns = 3;
constexpr std::uint32_t kMaxBins = 100'000;

bool fits_together(const v1::CoverageMap& map) {
  const std::uint64_t bins = std::uint64_t{map.x().bins()} * std::max(map.y().bins(), 1U);
  return bins > 0 && bins <= kMaxBins && static_cast<std::uint64_t>(map.counts_size()) == bins &&
         static_cast<std::uint64_t>(map.required_size()) == bins &&
         static_cast<std::uint64_t>(map.enough_size()) == bins;
}

/// Number of neighbours that become one, so that no more than `most` remain.
std::size_t merged(std::size_t bins, std::size_t most) {
  return (bins + most - 1) / most;
}

void join(CoverageCell& into, std::uint64_t count, bool required, bool enough) {
  using State = CoverageCell::State;
  const bool was_required = into.required();
  // Cells that ask for nothing say nothing about their neighbours that do.
  const bool all_enough = (!was_required || into.state == State::kEnough) && (!required || enough);
  into.count += count;
  if (!was_required && !required) {
    into.state = into.count > 0 ? State::kExtra : State::kEmpty;
  } else if (all_enough) {
    into.state = State::kEnough;
  } else {
    into.state = into.count > 0 ? State::kFew : State::kMissing;
  }
}

/// Shades from few samples to many, on a logarithmic scale.
std::string shade(std::uint64_t count, std::uint64_t most, bool unicode) {
  static constexpr const char* kBlocks[] = {"░", "▒", "▓", "█"};
  static constexpr const char* kLetters[] = {".", "+", "*", "#"};
  if (count == 0) return " ";
  const double depth = std::log1p(static_cast<double>(count)) / std::log1p(static_cast<double>(most));
  const auto level = static_cast<std::size_t>(std::clamp(std::ceil(depth * 4.0) - 1.0, 0.0, 3.0));
  return unicode ? kBlocks[level] : kLetters[level];
}

std::string cell_text(const CoverageCell& cell, std::uint64_t most, const Terminal& terminal) {
  const std::string heat = shade(cell.count, most, terminal.unicode);
  switch (cell.state) {
    case CoverageCell::State::kEmpty:
      return terminal.paint(Color::kGrey, terminal.unicode ? " · " : "   ");
    case CoverageCell::State::kExtra:
      return terminal.paint(Color::kGrey, " " + heat + " ");
    case CoverageCell::State::kMissing:
      return terminal.paint(Color::kRed, "[ ]");
    case CoverageCell::State::kFew:
      return terminal.paint(Color::kYellow, "[" + heat + "]");
    case CoverageCell::State::kEnough:
      return terminal.paint(Color::kGreen, "[" + heat + "]");
  }
  return "   ";
}

/// Value of the edge below row or column `index` of `count`.
std::string edge(const v1::CoverageMap::Axis& axis, std::size_t index, std::size_t per_cell) {
  const double bin = std::min(static_cast<double>(index * per_cell), static_cast<double>(axis.bins()));
  return fmt::format("{:.3g}", axis.from() + (axis.to() - axis.from()) * bin / std::max(1U, axis.bins()));
}

}  // namespace

std::string axis_label(const v1::CoverageMap::Axis& axis) {
  if (axis.unit().empty() || axis.unit() == "1") return axis.quantity();
  const bool compound = axis.unit().find_first_of("/* ") != std::string::npos;
  return axis.quantity() + (compound ? " / (" + axis.unit() + ")" : " / " + axis.unit());
}

std::optional<CoverageGrid> coverage_grid(const v1::CoverageMap& map, std::size_t max_columns,
                                          std::size_t max_rows) {
  if (!fits_together(map) || max_columns == 0 || max_rows == 0) return std::nullopt;
  const std::size_t x_bins = map.x().bins();
  const std::size_t y_bins = std::max(map.y().bins(), 1U);
  const std::size_t x_merged = merged(x_bins, max_columns);
  const std::size_t y_merged = merged(y_bins, max_rows);
  CoverageGrid grid{.columns = merged(x_bins, x_merged), .rows = merged(y_bins, y_merged), .cells = {}};
  grid.cells.resize(grid.columns * grid.rows);
  for (std::size_t i = 0; i < x_bins * y_bins; ++i) {
    CoverageCell& cell = grid.cells[i / x_bins / y_merged * grid.columns + i % x_bins / x_merged];
    join(cell, map.counts(static_cast<int>(i)), map.required(static_cast<int>(i)),
         map.enough(static_cast<int>(i)));
  }
  return grid;
}

std::vector<std::string> draw_coverage(const v1::CoverageMap& map, int width, int height,
                                       const Terminal& terminal) {
  constexpr int kMinWidth = 24;
  constexpr int kMinHeight = 5;
  constexpr int kAroundRows = 4;      // heading, axis, its edges, its name
  constexpr std::size_t kMargin = 7;  // of the labels of the rows
  if (width < kMinWidth || height < kMinHeight) return {};
  const auto columns = (static_cast<std::size_t>(width) - kMargin - 1) / kCellColumns;
  const auto grid = coverage_grid(map, columns, static_cast<std::size_t>(height - kAroundRows));
  if (!grid) return {};
  const std::size_t x_merged = merged(map.x().bins(), columns);
  const std::size_t y_merged =
      merged(std::max(map.y().bins(), 1U), static_cast<std::size_t>(height - kAroundRows));
  std::uint64_t most = 1;
  for (const CoverageCell& cell : grid->cells) most = std::max(most, cell.count);

  const bool plane = map.y().bins() > 0;
  std::vector<std::string> lines;
  const double share = std::isfinite(map.share()) ? map.share() : 0.0;
  const std::string covered = fmt::format("covered {:.0f} %", std::floor(100.0 * share + 1e-9));
  const std::string heading = plane ? axis_label(map.y()) : "samples by " + map.x().quantity();
  const auto whole = static_cast<std::size_t>(width);
  lines.push_back(padded(heading, whole - std::min(whole, covered.size())) + covered);
  for (std::size_t r = grid->rows; r-- > 0;) {
    const std::string label = plane ? edge(map.y(), r, y_merged) : "";
    std::string line = padded_left(label, kMargin - 1) + (terminal.unicode ? "┤" : "|");
    for (std::size_t c = 0; c < grid->columns; ++c) line += cell_text(grid->at(c, r), most, terminal);
    lines.push_back(line);
  }
  std::string axis = std::string(kMargin - 1, ' ') + (terminal.unicode ? "└" : "+");
  for (std::size_t i = 0; i < grid->columns * kCellColumns; ++i) axis += terminal.unicode ? "─" : "-";
  lines.push_back(axis);

  // Edges of columns, the quantity at the right end, or below them if there is no room for both.
  const std::string name = axis_label(map.x());
  const std::size_t name_width = std::min(whole, display_width(name));
  const std::size_t last_edge = kMargin + grid->columns * kCellColumns + 4;
  const bool name_fits_between = last_edge + name_width < whole;
  const std::size_t edges_end = name_fits_between ? whole - name_width - 1 : whole;
  std::string foot(name_fits_between ? whole - name_width : whole, ' ');
  std::size_t next_free = 0;
  for (std::size_t c = 0; c <= grid->columns; ++c) {
    const std::string label = edge(map.x(), c, x_merged);
    const std::size_t middle = kMargin + c * kCellColumns;
    const std::size_t begin = middle - std::min(middle, label.size() / 2);
    if (begin < next_free || begin + label.size() > edges_end) continue;
    foot.replace(begin, label.size(), label);
    next_free = begin + label.size() + 1;
  }
  lines.push_back(foot + (name_fits_between ? name : ""));
  if (!name_fits_between) lines.push_back(padded_left(padded(name, name_width), whole));
  return lines;
}

}  // namespace hapticd::cli
