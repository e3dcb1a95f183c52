#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/measure/study/loading/loading_study.h"

namespace hapticd::study {

namespace {

using report::fixed;

constexpr double kRates[] = {2.0, 10.0, 30.0};
constexpr double kGoal = 0.05;
constexpr double kGoalRate = 10.0;

report::Figure figure_of(const char* name, const LoadingCase& c, double rate_n_per_s, bool compensated,
                         const LoadingTrial& trial, const LoadingOutcome& outcome, double value) {
  report::Figure figure{name,
                        {{"device", c.device},
                         {"object", c.object},
                         {"target", c.target_n_per_mm},
                         {"rate_n_per_s", rate_n_per_s},
                         {"dims", c.dims},
                         {"compensation", compensated ? "default" : "none"}}};
  if (compensated && rate_n_per_s == kGoalRate) figure.goal = kGoal;
  figure.source = "D§3.4.3";
  if (outcome.failed.empty()) {
    figure.value = value;
  } else {
    figure.failed = outcome.failed + " at " + fixed(trial.force_n, 2) + " N of hand force";
  }
  return figure;
}

std::string percent(const LoadingOutcome& outcome, double value) {
  return outcome.failed.empty() ? fixed(100.0 * value, 1) : std::string(report::kNoNumber);
}

void add_curves(report::SvgPlot& plot, const std::string& label, const LoadingOutcome& outcome, int colour,
                bool dashed) {
  report::PlotSeries series{label};
  series.colour = colour;
  series.dashed = dashed;
  for (std::size_t i = 0; i < outcome.loading.size(); i += 5) {
    series.add(outcome.loading[i].hand_force_n, 100.0 * outcome.loading[i].error);
  }
  plot.series.push_back(series);
}

/// Mean and largest of what the cases of one device, scene and rate gave.
struct Summary {
  double sum[2] = {0.0, 0.0};
  double largest[2] = {0.0, 0.0};
  int count = 0;
  int within_goal[2] = {0, 0};
};

}  // namespace

void run_loading_error(StudyContext& context) {
  report::MarkdownTable table({"device", "object", "dims", "target N/mm", "press N", "rate N/s",
                               "reached N/s", "loading error %", "its mean %", "held error %",
                               "uncompensated: loading %", "held %"});
  report::MarkdownTable summary_table({"device", "dims", "rate N/s", "cases", "mean %", "largest %",
                                       "within 5 %", "uncompensated: mean %", "largest %", "within 5 %"});
  report::SvgPlot plot;
  plot.title = "Error at the hand while pressing with 10 N/s, one dimension (dashed: uncompensated)";
  plot.x = {"force at the hand", "N"};
  plot.y = {"error", "%"};
  plot.y.minimum = -40.0;
  plot.y.maximum = 60.0;
  plot.references = {{report::PlotReference::Axis::kY, 5.0, "+5 %"},
                     {report::PlotReference::Axis::kY, -5.0, "-5 %"}};
  std::map<std::string, Summary> summaries;
  int colour = 0;
  for (const LoadingCase& c : loading_cases(context.quick)) {
    for (const double rate : kRates) {
      LoadingTrial trial = c.trial(rate);
      const LoadingOutcome with = press_as_feasible(trial);
      LoadingTrial bare = trial;
      leave_uncompensated(bare.scene);
      const LoadingOutcome without = press(bare);
      Summary& summary = summaries[c.device + "|" + std::to_string(c.dims) + "|" + fixed(rate, 0)];
      for (const bool compensated : {true, false}) {
        const LoadingOutcome& outcome = compensated ? with : without;
        context.report.add(
            figure_of("loading_error_mean", c, rate, compensated, trial, outcome, outcome.error_mean));
        context.report.add(figure_of("held_error", c, rate, compensated, trial, outcome, outcome.error_held));
        if (!with.failed.empty() || !without.failed.empty()) continue;
        const int i = compensated ? 0 : 1;
        summary.sum[i] += outcome.error_mean;
        summary.largest[i] = std::max(summary.largest[i], outcome.error_mean);
        if (outcome.error_mean <= kGoal) ++summary.within_goal[i];
      }
      if (with.failed.empty() && without.failed.empty()) ++summary.count;
      table.add_row({c.device, c.object, fixed(c.dims, 0), fixed(c.target_n_per_mm, 1),
                     fixed(trial.force_n, 1), fixed(rate, 0), fixed(with.max_rate_n_per_s, 1),
                     with.failed.empty() ? percent(with, with.error_mean) : with.failed,
                     percent(with, with.error_signed), percent(with, with.error_held),
                     percent(without, without.error_mean), percent(without, without.error_held)});
      if (c.device != "phantom_1_0" || c.dims != 1 || rate != kGoalRate) continue;
      ++colour;
      add_curves(plot, c.object + ", " + fixed(c.target_n_per_mm, 1) + " N/mm", with, colour, false);
      add_curves(plot, "", without, colour, true);
    }
  }
  for (const std::string& device : sim::device_preset_names()) {
    for (const int dims : {1, 3}) {
      for (const double rate : kRates) {
        const auto found = summaries.find(device + "|" + std::to_string(dims) + "|" + fixed(rate, 0));
        if (found == summaries.end() || found->second.count == 0) continue;
        const Summary& s = found->second;
        summary_table.add_row({device, fixed(dims, 0), fixed(rate, 0), fixed(s.count, 0),
                               fixed(100.0 * s.sum[0] / s.count, 1), fixed(100.0 * s.largest[0], 1),
                               fixed(s.within_goal[0], 0), fixed(100.0 * s.sum[1] / s.count, 1),
                               fixed(100.0 * s.largest[1], 1), fixed(s.within_goal[1], 0)});
      }
    }
  }
  context.report.add_table(
      "loading_error", "Error at the hand while it presses", table,
      "True force of the hand over target stiffness and true displacement, less 1. Loading: mean of its "
      "magnitude from a tenth of the final displacement on until the hand means to hold; next to it the mean "
      "with its sign. Held: mean of the last second of a three-second hold. Rate: the largest that the hand "
      "means to reach; reached: the largest over 20 ms. Uncompensated: no lead, and the arm's friction is "
      "left to the hand.");
  context.report.add_table("loading_summary", "Error while pressing, by device and scene", summary_table);
  context.report.add_plot("loading_error", plot);
}

}  // namespace hapticd::study
