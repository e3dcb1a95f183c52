#include "client/cli/identify/identify_figure.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/identify/identify_coverage.h"
#include "client/cli/identify/identify_view.h"
#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

using CurveLine = FigureSeries::Line;
using CurveMark = FigureSeries::Mark;

constexpr std::size_t kMaxCells = 40;  // in a row or a column
constexpr int kMaxMaps = 2;

FigurePanel fit_panel(const v1::IdentificationProgress& progress) {
  FigureSeries measured{
      .name = "measured", .color = "#0072b2", .line = CurveLine::kNone, .mark = CurveMark::kDisc};
  FigureSeries model{.name = "model", .color = "#d55e00"};
  const bool ordered =
      std::is_sorted(progress.fit().begin(), progress.fit().end(),
                     [](const v1::FitPoint& a, const v1::FitPoint& b) { return a.x() < b.x(); });
  if (!ordered) {
    model.line = CurveLine::kNone;
    model.mark = CurveMark::kDisc;
  }
  for (const auto& point : progress.fit()) {
    measured.points.push_back({point.x(), point.measured()});
    model.points.push_back({point.x(), point.model()});
  }
  return {.title = progress.has_residual()
                       ? fmt::format("Fit, residual {:.2g} %", 100.0 * progress.residual())
                       : std::string("Fit"),
          .x = {plot_label(progress.fit_x())},
          .y = {plot_label(progress.fit_y())},
          .left = 0.0,
          .bottom = 0.0,
          .width = 0.55,
          .height = 0.94,
          .legend = FigurePanel::Legend::kBelow,
          .series = {std::move(measured), std::move(model)}};
}

/// A mark in the middle of each cell, by what the cell has.
FigurePanel coverage_panel(const v1::CoverageMap& map, const CoverageGrid& grid) {
  const double x_step = (map.x().to() - map.x().from()) / static_cast<double>(grid.columns);
  const bool plane = map.y().bins() > 0;
  const double y_from = plane ? map.y().from() : 0.0;
  const double y_to = plane ? map.y().to() : 1.0;
  const double y_step = (y_to - y_from) / static_cast<double>(grid.rows);
  const auto squares = [](const char* name, const char* color, CurveMark mark = CurveMark::kSquare) {
    return FigureSeries{
        .name = name, .color = color, .line = CurveLine::kNone, .mark = mark, .mark_size = 1.6};
  };
  FigureSeries extra = squares("not required", "#bbbbbb");
  FigureSeries enough = squares("enough", "#009e73");
  FigureSeries few = squares("too few", "#e69f00");
  FigureSeries missing = squares("missing", "#d55e00", CurveMark::kOpenSquare);
  for (std::size_t row = 0; row < grid.rows; ++row) {
    for (std::size_t column = 0; column < grid.columns; ++column) {
      const Point middle{map.x().from() + x_step * (static_cast<double>(column) + 0.5),
                         y_from + y_step * (static_cast<double>(row) + 0.5)};
      switch (grid.at(column, row).state) {
        case CoverageCell::State::kEmpty:
          break;
        case CoverageCell::State::kExtra:
          extra.points.push_back(middle);
          break;
        case CoverageCell::State::kMissing:
          missing.points.push_back(middle);
          break;
        case CoverageCell::State::kFew:
          few.points.push_back(middle);
          break;
        case CoverageCell::State::kEnough:
          enough.points.push_back(middle);
          break;
      }
    }
  }
  FigureSeries frame{.color = "#dddddd",
                     .line = CurveLine::kThin,
                     .points = {{map.x().from(), y_from},
                                {map.x().to(), y_from},
                                {map.x().to(), y_to},
                                {map.x().from(), y_to},
                                {map.x().from(), y_from}}};
  return {
      .title = fmt::format("Covered {:.0f} %", std::floor(100.0 * map.share() + 1e-9)),
      .x = {axis_label(map.x())},
      .y = {plane ? axis_label(map.y()) : ""},
      .legend = FigurePanel::Legend::kAbove,
      .series = {std::move(frame), std::move(extra), std::move(enough), std::move(few), std::move(missing)}};
}

}  // namespace

Figure identify_figure(const v1::IdentificationProgress& progress) {
  Figure figure{
      .title = fmt::format("{}: {}, {} after {:.1f} s", progress.identification(), identify_subject(progress),
                           word(progress.state()), progress.duration_s()),
      .width_px = 1200,
      .height_px = 600,
      .panels = {}};
  const bool has_fit = std::any_of(progress.fit().begin(), progress.fit().end(), [](const v1::FitPoint& p) {
    return std::isfinite(p.x()) && (std::isfinite(p.measured()) || std::isfinite(p.model()));
  });
  if (has_fit) figure.panels.push_back(fit_panel(progress));
  std::vector<FigurePanel> maps;
  for (const auto& map : progress.coverage()) {
    const auto grid = coverage_grid(map, kMaxCells, kMaxCells);
    if (!grid || static_cast<int>(maps.size()) == kMaxMaps) continue;
    if (!(map.x().to() > map.x().from()) || (map.y().bins() > 0 && !(map.y().to() > map.y().from())))
      continue;
    maps.push_back(coverage_panel(map, *grid));
  }
  const double left = has_fit ? 0.55 : 0.0;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    maps[i].left = left;
    maps[i].width = 1.0 - left;
    maps[i].height = 0.94 / static_cast<double>(maps.size());
    maps[i].bottom = 0.94 - maps[i].height * static_cast<double>(i + 1);
    figure.panels.push_back(std::move(maps[i]));
  }
  return figure;
}

}  // namespace hapticd::cli
