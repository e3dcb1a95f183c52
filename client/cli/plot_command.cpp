#include <fmt/core.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/csv_table.h"
#include "client/cli/figure.h"

namespace hapticd::cli {
namespace {

constexpr std::size_t kMaxPoints = 8000;

struct PlotOptions {
  std::string recording;
  std::string svg;
};

/// A column of a recording and how it is drawn.
struct Trace {
  const char* column;
  const char* name;
  const char* color;
  double sign = 1.0;
};

constexpr Trace kForceTraces[] = {{"truth_hand_force_z_n", "hand, true", "#999999", -1.0},
                                  {"contact_reaction_force_n", "reaction", "#e69f00"},
                                  {"control_hand_force_n", "hand, estimated", "#0072b2"},
                                  {"control_commanded_force_n", "device, commanded", "#cc79a7"}};
constexpr Trace kDisplacementTraces[] = {{"truth_displacement_mm", "true", "#999999"},
                                         {"deformation_displacement_mm", "estimated", "#009e73"}};
constexpr Trace kTarget{"target_stiffness_n_per_mm", "target", "#d55e00"};

std::vector<Point> points(const std::vector<double>& x, const std::vector<double>& y, double sign) {
  std::vector<Point> result;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool there = std::isfinite(x[i]) && std::isfinite(y[i]);
    const bool after_break = result.empty() || !std::isfinite(result.back().x);
    if (there) {
      result.push_back({x[i], sign * y[i]});
    } else if (!after_break) {
      result.push_back(kBreak);
    }
  }
  return thinned(result, kMaxPoints);
}

void add_trace(FigurePanel& panel, const CsvTable& table, const std::vector<double>& x, const Trace& trace,
               FigureSeries::Stroke stroke) {
  if (!table.has(trace.column)) return;
  FigureSeries series{trace.name, trace.color, stroke, points(x, table.column(trace.column), trace.sign)};
  if (!series.points.empty()) panel.series.push_back(std::move(series));
}

Figure figure_of(const CsvTable& table) {
  std::vector<double> time_s = table.column("time_s");
  for (double& t : time_s) t -= table.column("time_s").front();
  const bool estimated = table.has("deformation_displacement_mm");
  // Estimates are drawn over the estimated displacement, the truth over the true one; where one is missing,
  // all over the other.
  const auto& displacement =
      table.column(estimated ? "deformation_displacement_mm" : "truth_displacement_mm");

  FigurePanel curve{.title = "Force over displacement",
                    .x_label = "displacement / mm",
                    .y_label = "force / N",
                    .left = 0.0,
                    .bottom = 0.0,
                    .width = 0.5,
                    .height = 0.95,
                    .legend = FigurePanel::Legend::kBelow};
  for (const Trace& trace : kForceTraces) {
    const bool is_truth =
        std::string_view(trace.column).starts_with("truth_") && table.has("truth_displacement_mm");
    add_trace(curve, table, is_truth ? table.column("truth_displacement_mm") : displacement, trace,
              is_truth ? FigureSeries::Stroke::kThinLine : FigureSeries::Stroke::kLine);
  }
  FigurePanel forces{.title = "Over time",
                     .x_label = "",
                     .y_label = "force / N",
                     .left = 0.5,
                     .bottom = 0.64,
                     .width = 0.5,
                     .height = 0.31};
  for (Trace trace : kForceTraces) {
    trace.name = "";  // told beside
    add_trace(forces, table, time_s, trace, FigureSeries::Stroke::kThinLine);
  }
  FigurePanel depth{.title = "",
                    .x_label = "",
                    .y_label = "displacement / mm",
                    .left = 0.5,
                    .bottom = 0.34,
                    .width = 0.5,
                    .height = 0.31,
                    .legend = FigurePanel::Legend::kAbove};
  for (const Trace& trace : kDisplacementTraces)
    add_trace(depth, table, time_s, trace, FigureSeries::Stroke::kThinLine);
  FigurePanel target{.title = "",
                     .x_label = "time / s",
                     .y_label = "stiffness / (N/mm)",
                     .left = 0.5,
                     .bottom = 0.0,
                     .width = 0.5,
                     .height = 0.35,
                     .legend = FigurePanel::Legend::kAbove};
  add_trace(target, table, time_s, kTarget, FigureSeries::Stroke::kLine);

  Figure figure{
      .title = std::filesystem::path(table.path()).filename().string(), .width_px = 1200, .height_px = 700};
  for (FigurePanel* panel : {&curve, &forces, &depth, &target}) {
    if (!panel->series.empty()) figure.panels.push_back(std::move(*panel));
  }
  if (figure.panels.empty()) {
    throw LocalError("there is nothing to draw in the recording", table.path(), "", "",
                     "record with the groups contact, deformation and control, or truth");
  }
  return figure;
}

}  // namespace

void add_plot_command(CLI::App& app, Session& session) {
  const auto options = std::make_shared<PlotOptions>();
  CLI::App* command =
      app.add_subcommand("plot", "Draws a recording: force over displacement, and the time courses");
  command->footer(
      "Needs gnuplot (Debian: gnuplot-nox), but no daemon. Estimates are drawn over the estimated "
      "displacement,\n"
      "the truth of a simulated rig over the true one: an object that has not yet recovered from the press "
      "before\n"
      "begins deeper, and its true curve stands aside by that.\n\n"
      "Example:\n  hapticctl plot press.csv --out press.svg");
  command->add_option("RECORDING.csv", options->recording, "Written by hapticctl telemetry record")
      ->required();
  command->add_option("-o,--out", options->svg, "Where to write the plot (SVG)")->required();
  command->callback([&session, options] {
    if (std::filesystem::path(options->svg).extension() != ".svg") {
      throw LocalError("plots are drawn as SVG only", "--out", options->svg, "a name that ends in .svg",
                       "convert it afterwards, e.g. with rsvg-convert");
    }
    const CsvTable table = CsvTable::read(options->recording);
    write_svg(figure_of(table), options->svg);
    if (session.json) return print_json({{"plot", options->svg}, {"samples", table.rows()}});
    fmt::print("{}: {} samples drawn\n", options->svg, table.rows());
  });
}

}  // namespace hapticd::cli
