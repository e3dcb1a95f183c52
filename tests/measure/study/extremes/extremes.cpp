#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study {

namespace {

using extremes::Effort;
using extremes::Extreme;
using extremes::ExtremeGroup;
using report::significant;

std::vector<ExtremeGroup> all_groups() {
  return {extremes::signal_extremes(),     extremes::contact_extremes(),     extremes::friction_extremes(),
          extremes::modulation_extremes(), extremes::deformation_extremes(), extremes::target_extremes(),
          extremes::guard_extremes(),      extremes::identify_extremes(),    extremes::time_extremes(),
          extremes::scene_extremes(),      extremes::simulator_extremes(),   extremes::unexcited_extremes()};
}

/// 0.0023 and 1.2e-13, but not 0.00000000000012.
std::string shown(double value) {
  if (value == 0.0) return "0";
  const double magnitude = std::abs(value);
  if (magnitude >= 1e-3 && magnitude < 1e5) return significant(value, 3);
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value);
  return text;
}

struct Outcome {
  const Extreme* extreme = nullptr;
  double value = 0.0;
  bool finite() const { return std::isfinite(value); }
  bool holds() const { return finite() && value <= extreme->bound; }
};

void add_figure(report::Report& report, const Outcome& outcome) {
  report::Figure figure{"extreme_error",
                        {{"stage", outcome.extreme->stage}, {"extreme", outcome.extreme->extreme}}};
  figure.unit = outcome.extreme->unit;
  figure.goal = outcome.extreme->bound;
  figure.source = outcome.extreme->because;
  if (outcome.finite()) {
    figure.value = outcome.value;
  } else {
    figure.failed = outcome.extreme->measured + " is not finite";
  }
  report.add(figure);
}

void add_group(report::Report& report, const ExtremeGroup& group, const std::vector<Outcome>& outcomes) {
  report::MarkdownTable table(
      {"stage", "extreme", "measured", "value", "bound", "unit", "bound from", "holds"});
  for (const Outcome& outcome : outcomes) {
    const Extreme& extreme = *outcome.extreme;
    table.add_row({extreme.stage, extreme.extreme, extreme.measured,
                   outcome.finite() ? shown(outcome.value) : "not finite", shown(extreme.bound), extreme.unit,
                   extreme.because, outcome.holds() ? "yes" : "NO"});
    add_figure(report, outcome);
  }
  report.add_table("extremes_" + group.name, group.title, table);
}

/// Everything at a glance: how much of its bound each case uses. What is zero, or uses less than 1e-12 of it,
/// is on the lowest line.
void plot_margins(report::Report& report, const std::vector<ExtremeGroup>& groups,
                  const std::vector<std::vector<Outcome>>& outcomes) {
  constexpr double kMin = 1e-12;
  report::Plot plot;
  plot.title = "Share of its bound that each extreme uses";
  plot.y = {"value / bound", "1", true, 0.3 * kMin, 10.0};
  report::PlotSeries hold{"holds"}, fail{"does not hold"};
  for (report::PlotSeries* series : {&hold, &fail}) {
    series->marks_only();
    series->mark_size = 0.7;
  }
  for (std::size_t g = 0; g < groups.size(); ++g) {
    plot.x.categories.push_back(groups[g].name);
    const auto count = static_cast<double>(outcomes[g].size());
    for (std::size_t i = 0; i < outcomes[g].size(); ++i) {
      const Outcome& outcome = outcomes[g][i];
      const double bound = outcome.extreme->bound;
      double share = bound != 0.0 ? outcome.value / bound : (outcome.value == 0.0 ? 0.0 : 10.0);
      if (!outcome.finite()) share = 10.0;
      report::PlotSeries& series = outcome.holds() ? hold : fail;
      series.add(static_cast<double>(g) + 0.7 * ((static_cast<double>(i) + 0.5) / count - 0.5),
                 std::clamp(share, kMin, 10.0));
    }
  }
  plot.series.push_back(hold);
  if (!fail.points.empty()) plot.series.push_back(fail);
  plot.references.push_back({report::PlotReference::Axis::kY, 1.0, "bound"});
  report.add_plot("extremes_margins", plot, {.height_px = 380});
}

}  // namespace

void run_extremes(StudyContext& context) {
  const Effort effort{context.quick};
  const std::vector<ExtremeGroup> groups = all_groups();
  std::vector<const Extreme*> all;
  for (const ExtremeGroup& group : groups) {
    for (const Extreme& extreme : group.extremes) all.push_back(&extreme);
  }
  const auto values = context.cells.values(
      "extremes", all.size(), [&](std::size_t i) { return report::CellValues{all[i]->measure(effort)}; });
  if (!values) return;

  std::vector<std::vector<Outcome>> outcomes(groups.size());
  std::size_t next = 0;
  std::string broken;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const Extreme& extreme : groups[g].extremes) {
      outcomes[g].push_back({&extreme, (*values)[next++].front()});
      if (!outcomes[g].back().holds()) {
        broken += (broken.empty() ? "" : "; ") + extreme.stage + ", " + extreme.extreme;
      }
    }
  }
  context.report.say(
      "Every stage is run at its extremes, by the classes that ship, and held to a bound that was stated "
      "beforehand: from a closed form, from rounding (2.2e-16 a step), or from what the stage promises. "
      "\"Ten hours\" are 36 million ticks" +
      std::string(context.quick ? " (here, in a quick run, a hundredth of every such length)." : "."));
  context.report.say(broken.empty()
                         ? std::to_string(all.size()) + " extremes, all of them hold."
                         : std::to_string(all.size()) + " extremes; these do not hold: " + broken + ".");
  plot_margins(context.report, groups, outcomes);
  for (std::size_t g = 0; g < groups.size(); ++g) add_group(context.report, groups[g], outcomes[g]);
}

}  // namespace hapticd::study
