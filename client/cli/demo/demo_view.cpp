#include "client/cli/demo/demo_view.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "client/cli/plot/terminal_plot.h"

namespace hapticd::cli {
namespace {

constexpr std::size_t kTerminalPoints = 1500;
constexpr std::size_t kFigurePoints = 3000;
constexpr std::array<Color, 5> kColors{Color::kCyan, Color::kYellow, Color::kGreen, Color::kMagenta,
                                       Color::kBlue};
constexpr double kErrorBand = 0.05;

/// Force over displacement while the tip touches, up to where it first comes free of the object on the way
/// up, or from there on: what follows is not the rendering of a stiffness but its end.
enum class Part { kPress, kAfterRelease };
std::vector<Point> curve(const PressTrace& trace, Part part, std::size_t max_points) {
  const auto release = release_point(trace.points());
  std::vector<Point> points;
  for (std::size_t i = 0; i < trace.points().size(); ++i) {
    const PressPoint& point = trace.points()[i];
    if ((release && i > release->index) != (part == Part::kAfterRelease)) continue;
    if (point.in_contact) {
      points.push_back({point.displacement_mm, point.hand_force_n});
    } else if (!points.empty() && std::isfinite(points.back().x)) {
      points.push_back(kBreak);
    }
  }
  return thinned(points, max_points);
}

/// End of the line that a target asks for, within the forces and displacements of the press.
Point target_end(double target_n_per_mm, double largest_force_n, double largest_displacement_mm) {
  const double x = std::min(largest_displacement_mm, largest_force_n / std::max(target_n_per_mm, 1e-6));
  return {x, x * target_n_per_mm};
}

struct Extent {
  double force_n = 0.5;
  double displacement_mm = 1.0;
};

Extent extent(const std::vector<DemoPress>& presses) {
  Extent result;
  for (const auto& press : presses) {
    for (const auto& point : press.trace.points()) {
      result.displacement_mm = std::max(result.displacement_mm, point.displacement_mm);
      if (point.in_contact) result.force_n = std::max(result.force_n, point.hand_force_n);
    }
  }
  return result;
}

}  // namespace

std::vector<std::string> demo_frame(const std::vector<DemoPress>& presses, const std::string& state,
                                    const Terminal& terminal) {
  const Extent largest = extent(presses);
  TerminalPlotFrame frame{"displacement / mm",
                          "force of the hand / N",
                          rounded({0.0, largest.displacement_mm}),
                          rounded({0.0, largest.force_n}),
                          std::min(terminal.width, 120),
                          0};
  std::vector<TerminalSeries> series;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const auto& press = presses[i];
    const Color color =
        press.target_n_per_mm ? kColors[(i + kColors.size() - 1) % kColors.size()] : Color::kGrey;
    if (press.target_n_per_mm) {
      series.push_back({"",
                        color,
                        TerminalSeries::Stroke::kDashed,
                        {{0.0, 0.0}, target_end(*press.target_n_per_mm, frame.y.high, frame.x.high)}});
    }
    series.push_back({press.target_n_per_mm ? fmt::format("{:g} N/mm", *press.target_n_per_mm) : "as it is",
                      color, TerminalSeries::Stroke::kLine,
                      curve(press.trace, Part::kPress, kTerminalPoints)});
  }
  series.push_back({"target", Color::kDefault, TerminalSeries::Stroke::kDashed, {}});  // for the legend only
  const auto table = result_table(presses).lines(terminal, 2);
  frame.height = std::clamp(terminal.height - static_cast<int>(table.size()) - 4, 8, 28);

  std::vector<std::string> lines{terminal.bold(state)};
  const auto plot = draw(frame, series, terminal);
  lines.insert(lines.end(), plot.begin(), plot.end());
  lines.emplace_back();
  lines.insert(lines.end(), table.begin(), table.end());
  return lines;
}

Figure demo_figure(const std::vector<DemoPress>& presses, const std::string& title) {
  const Extent largest = extent(presses);
  FigurePanel curves{.title = "Felt by the hand",
                     .x = {"displacement of the tip", "mm"},
                     .y = {"force of the hand", "N"},
                     .left = 0.0,
                     .bottom = 0.0,
                     .width = 0.62,
                     .height = 0.94,
                     .legend = FigurePanel::Legend::kBelow,
                     .from_zero = true};
  FigurePanel results{.title = "Settled",
                      .x = {"target", "N/mm"},
                      .y = {"rendered at the hand", "N/mm"},
                      .left = 0.62,
                      .bottom = 0.0,
                      .width = 0.38,
                      .height = 0.94,
                      .from_zero = true};
  // Without a word the fall on release would be taken for a fault of the control.
  FigureSeries released{.name = "the tip comes free",
                        .color = "#333333",
                        .line = FigureSeries::Line::kNone,
                        .mark = FigureSeries::Mark::kOpenSquare,
                        .mark_size = 1.6};
  FigureSeries rendered{.name = "rendered",
                        .color = "#d55e00",
                        .line = FigureSeries::Line::kNone,
                        .mark = FigureSeries::Mark::kDisc};
  double highest = 0.0;
  std::size_t index = 0;
  for (const auto& press : presses) {
    if (!press.hold) continue;
    if (const auto release = release_point(press.trace.points())) {
      released.points.push_back({release->displacement_mm, release->hand_force_n});
    }
    if (!press.target_n_per_mm) {
      curves.series.push_back({fmt::format("as it is: {:.3f} N/mm", press.hold->stiffness_n_per_mm()),
                               "#888888", FigureSeries::Line::kSolid,
                               curve(press.trace, Part::kPress, kFigurePoints)});
      continue;
    }
    const std::string color = palette(index++);
    curves.series.push_back({fmt::format("{:g} N/mm: {:.3f} ({:+.1f} %)", *press.target_n_per_mm,
                                         press.hold->stiffness_n_per_mm(), 100.0 * *press.error()),
                             color, FigureSeries::Line::kSolid,
                             curve(press.trace, Part::kPress, kFigurePoints)});
    curves.series.push_back(
        {"",
         color,
         FigureSeries::Line::kDashed,
         {{0.0, 0.0}, target_end(*press.target_n_per_mm, largest.force_n, largest.displacement_mm)}});
    rendered.points.push_back({*press.target_n_per_mm, press.hold->stiffness_n_per_mm()});
    highest = std::max(highest, 1.1 * *press.target_n_per_mm);
  }
  for (std::size_t i = 0, color = 0; i < presses.size(); ++i) {
    if (!presses[i].hold) continue;
    curves.series.push_back({"", presses[i].target_n_per_mm ? palette(color++) : "#888888",
                             FigureSeries::Line::kDots,
                             curve(presses[i].trace, Part::kAfterRelease, kFigurePoints)});
  }
  curves.series.push_back({"as asked", "#555555", FigureSeries::Line::kDashed, {{0.0, 0.0}, {0.0, 0.0}}});
  curves.series.push_back(std::move(released));
  results.series.push_back(
      {"as asked", "#555555", FigureSeries::Line::kDashed, {{0.0, 0.0}, {highest, highest}}});
  results.series.push_back({"±5 %",
                            "#aaaaaa",
                            FigureSeries::Line::kThin,
                            {{0.0, 0.0},
                             {highest, highest * (1.0 + kErrorBand)},
                             kBreak,
                             {0.0, 0.0},
                             {highest, highest * (1.0 - kErrorBand)}}});
  results.series.push_back(std::move(rendered));
  return {
      .title = title,
      .width_px = 1200,
      .height_px = 640,
      .notes = {"On letting go the object recovers more slowly than the hand lifts: as its reaction fades, "
                "so does the force, and at a square the tip comes free of it, at depth. Where nothing is "
                "touched no force is given (dotted: a short second contact)."},
      .panels = {std::move(curves), std::move(results)}};
}

}  // namespace hapticd::cli
