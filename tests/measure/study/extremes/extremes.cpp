#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/extremes/extreme.h"

namespace hapticd::study {

namespace {

using extremes::Effort;
using extremes::Extreme;
using extremes::ExtremeGroup;

std::vector<ExtremeGroup> all_groups() {
  return {extremes::signal_extremes(),     extremes::contact_extremes(),     extremes::friction_extremes(),
          extremes::modulation_extremes(), extremes::deformation_extremes(), extremes::target_extremes(),
          extremes::guard_extremes(),      extremes::identify_extremes(),    extremes::time_extremes(),
          extremes::scene_extremes(),      extremes::simulator_extremes(),   extremes::unexcited_extremes()};
}

/// 0.0023 and 1.2e-13, but not 0.00000000000012.
std::string shown(double value) {
  if (!std::isfinite(value)) return "not finite";
  const double magnitude = std::abs(value);
  if (value == 0.0 || (magnitude >= 1e-3 && magnitude < 1e5)) return report::significant(value, 3);
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value);
  return text;
}

report::Figure figure_of(const Extreme& extreme, double value) {
  report::Figure figure{"extreme_error", {{"stage", extreme.stage}, {"extreme", extreme.extreme}}};
  figure.unit = extreme.unit;
  figure.goal = extreme.bound;
  figure.source = extreme.because;
  figure.value = value;
  if (!std::isfinite(value)) figure.failed = extreme.measured + " is not finite";
  return figure;
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

  context.report.say(
      "Every stage is run at its extremes, by the classes that ship, and held to a bound that was stated "
      "beforehand: from a closed form, from rounding (2.2e-16 a step), or from what the stage promises. "
      "\"Ten hours\" are 36 million ticks" +
      std::string(context.quick ? " (here, in a quick run, a hundredth of every such length)." : "."));
  std::size_t next = 0;
  std::string broken;
  for (const ExtremeGroup& group : groups) {
    report::MarkdownTable table(
        {"stage", "extreme", "measured", "value", "bound", "unit", "bound from", "holds"});
    for (const Extreme& extreme : group.extremes) {
      const double value = (*values)[next++].front();
      const bool holds = value <= extreme.bound;  // false for NaN
      if (!holds) broken += (broken.empty() ? "" : "; ") + extreme.stage + ", " + extreme.extreme;
      table.add_row({extreme.stage, extreme.extreme, extreme.measured, shown(value), shown(extreme.bound),
                     extreme.unit, extreme.because, holds ? "yes" : "NO"});
      context.report.add(figure_of(extreme, value));
    }
    context.report.add_table("extremes_" + group.name, group.title, table);
  }
  context.report.say(std::to_string(all.size()) + (broken.empty()
                                                       ? " extremes, all of them hold."
                                                       : " extremes; these do not hold: " + broken + "."));
}

}  // namespace hapticd::study
