#include <string>

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

}  // namespace

void run_loading_error(StudyContext& context) {
  report::MarkdownTable table({"device", "object", "dims", "target N/mm", "press N", "rate N/s",
                               "reached N/s", "loading error %", "its mean %", "held error %",
                               "uncompensated: loading %", "held %"});
  for (const LoadingCase& c : loading_cases(context.quick)) {
    for (const double rate : kRates) {
      LoadingTrial trial = c.trial(rate);
      const LoadingOutcome with = press_as_feasible(trial);
      LoadingTrial bare = trial;
      leave_uncompensated(bare.scene);
      const LoadingOutcome without = press(bare);
      for (const bool compensated : {true, false}) {
        const LoadingOutcome& outcome = compensated ? with : without;
        context.report.add(
            figure_of("loading_error_mean", c, rate, compensated, trial, outcome, outcome.error_mean));
        context.report.add(figure_of("held_error", c, rate, compensated, trial, outcome, outcome.error_held));
      }
      table.add_row({c.device, c.object, fixed(c.dims, 0), fixed(c.target_n_per_mm, 1),
                     fixed(trial.force_n, 1), fixed(rate, 0), fixed(with.max_rate_n_per_s, 1),
                     with.failed.empty() ? percent(with, with.error_mean) : with.failed,
                     percent(with, with.error_signed), percent(with, with.error_held),
                     percent(without, without.error_mean), percent(without, without.error_held)});
    }
  }
  context.report.add_table(
      "loading_error", "Error at the hand while it presses", table,
      "True force of the hand over target stiffness and true displacement, less 1. Loading: mean of its "
      "magnitude from a tenth of the final displacement on until the hand means to hold; next to it the mean "
      "with its sign. Held: mean of the last second of a three-second hold. Rate: the largest that the hand "
      "means to reach; reached: the largest over 20 ms. Uncompensated: no lead, and the arm's friction is "
      "left to the hand.");
}

}  // namespace hapticd::study
