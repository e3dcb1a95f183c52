#include "tests/measure/report/work_precision.h"

#include <algorithm>
#include <stdexcept>

namespace hapticd::report {
namespace {

constexpr double kFaster = 0.90;
constexpr double kAsFast = 1.10;
constexpr double kBetter = 0.98;

const Method& default_of(const WorkPrecision& stage) {
  const auto is_default = [](const Method& m) { return m.is_default; };
  if (std::count_if(stage.methods.begin(), stage.methods.end(), is_default) != 1) {
    throw std::logic_error("stage '" + stage.stage + "' needs exactly one default");
  }
  return *std::find_if(stage.methods.begin(), stage.methods.end(), is_default);
}

std::vector<Method> front_of(const WorkPrecision& stage) {
  std::vector<Method> front;
  for (const Method& method : stage.methods) {
    if (is_on_front(stage, method)) front.push_back(method);
  }
  std::sort(front.begin(), front.end(),
            [](const Method& a, const Method& b) { return a.run_time_ns < b.run_time_ns; });
  return front;
}

Plot plot_of(const WorkPrecision& stage) {
  Plot plot;
  plot.title = "Error against run time: " + stage.stage;
  plot.x = {"run time per " + stage.run_time_per, "ns", true};
  plot.y = {stage.error_name, stage.error_unit, stage.logarithmic_error};
  if (!stage.logarithmic_error) plot.y.minimum = 0.0;
  PlotSeries front;
  front.name = "Pareto front";
  front.color = cli::palette(7);
  front.line = PlotLine::kDashed;
  for (const Method& method : front_of(stage)) {
    front.add(method.run_time_ns, method.error);
  }
  plot.series.push_back(front);
  std::size_t colour = 0;
  for (const Method& method : stage.methods) {
    if (!method.failed.empty()) continue;
    PlotSeries point;
    point.name = method.name + (method.is_default ? " (default)" : "");
    point.add(method.run_time_ns, method.error);
    point.marks_only(method.is_default ? 1.6 : 0.9);
    point.color = cli::palette(colour % 7);
    if (method.is_default) point.mark = PlotMark::kDisc;
    ++colour;
    plot.series.push_back(point);
  }
  return plot;
}

std::string verdict_on(const WorkPrecision& stage, const Method& chosen) {
  if (!chosen.failed.empty())
    throw std::logic_error("stage '" + stage.stage + "': its default failed: " + chosen.failed);
  if (is_on_front(stage, chosen)) return "The default, " + chosen.name + ", is on the Pareto front.";
  if (stage.justification.empty()) {
    throw std::logic_error("stage '" + stage.stage + "': the default, " + chosen.name +
                           ", is off the Pareto front and nothing says why it is kept");
  }
  return "The default, " + chosen.name + ", is off the Pareto front: " + stage.justification;
}

}  // namespace

bool is_on_front(const WorkPrecision& stage, const Method& method) {
  if (!method.failed.empty()) return false;
  return std::none_of(stage.methods.begin(), stage.methods.end(), [&method](const Method& other) {
    if (&other == &method || !other.failed.empty()) return false;
    const bool faster = other.run_time_ns < kFaster * method.run_time_ns && other.error <= method.error;
    const bool better =
        other.error < kBetter * method.error && other.run_time_ns <= kAsFast * method.run_time_ns;
    return faster || better;
  });
}

void add_work_precision(Report& report, const WorkPrecision& stage) {
  const Method& chosen = default_of(stage);
  MarkdownTable table({"method", stage.error_name + " [" + stage.error_unit + "]",
                       "ns per " + stage.run_time_per, "Pareto front", "default", "failed"});
  for (const Method& method : stage.methods) {
    Figure figure{.figure = "error_vs_runtime",
                  .conditions = {{"stage", stage.stage}, {"method", method.name}},
                  .unit = stage.error_unit,
                  .source = method.is_default ? kDefaultMethod : "",
                  .failed = method.failed};
    if (method.failed.empty()) {
      figure.value = method.error;
      figure.run_time_ns = method.run_time_ns;
    }
    report.add(figure);
    const bool worked = method.failed.empty();
    table.add_row({method.name, worked ? significant(method.error, 3) : kNoNumber,
                   worked ? significant(method.run_time_ns, 3) : kNoNumber,
                   is_on_front(stage, method) ? "yes" : "", method.is_default ? "default" : "",
                   method.failed});
  }
  const std::string name = "precision_" + stage.stage;
  report.add_table(name, "Error against run time: " + stage.stage, table, stage.remark);
  report.add_plot(name, plot_of(stage));
  report.say(verdict_on(stage, chosen));
}

}  // namespace hapticd::report
