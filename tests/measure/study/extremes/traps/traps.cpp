#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/extremes/traps/trap.h"

namespace hapticd::study {

namespace extremes {

report::Plot small_plot(std::string title, report::PlotAxis x, report::PlotAxis y) {
  report::Plot plot;
  plot.title = std::move(title);
  plot.x = std::move(x);
  plot.y = std::move(y);
  return plot;
}

report::PlotSeries published(std::string label) {
  report::PlotSeries series{std::move(label)};
  series.color = cli::palette(1);
  series.line = report::PlotLine::kDashed;
  return series;
}

report::PlotSeries ours(std::string label) {
  report::PlotSeries series{std::move(label)};
  series.color = cli::palette(0);
  return series;
}

}  // namespace extremes

namespace {

std::string shown(double value) {
  const double magnitude = std::abs(value);
  if (value == 0.0) return "0";
  if (magnitude >= 1e-3 && magnitude < 1e5) return report::significant(value, 3);
  char text[32];
  std::snprintf(text, sizeof text, "%.1e", value);
  return text;
}

}  // namespace

void run_traps(StudyContext& context) {
  using namespace extremes;
  const std::vector<Trap> traps{derivative_gain_trap(),
                                integrating_loop_trap(),
                                stability_bound_trap(),
                                deflection_loop_trap(),
                                deflection_sign_trap(),
                                dahl_counting_trap(),
                                dahl_euler_trap(),
                                tumour_trap(),
                                inverse_noise_trap(),
                                static_sponge_trap(),
                                staircase_trap(context.quick),
                                encoder_trap()};
  context.report.say(
      "Equations and numbers of the dissertation that fail when taken as printed, each coded as printed "
      "(orange, dashed) next to what hapticd does (blue), with the closed form that predicts the failure.");
  report::MarkdownTable table(
      {"trap", "what fails", "predicted by", "measured", "form", "value", "limit", "unit"});
  for (const Trap& trap : traps) {
    bool first = true;
    for (const TrapForm& form : trap.forms) {
      report::Figure figure{"trap", {{"trap", trap.name}, {"form", form.form}}};
      figure.unit = trap.unit;
      figure.goal = trap.limit;
      figure.source = trap.predicts;
      if (std::isfinite(form.value)) {
        figure.value = form.value;
      } else {
        figure.failed = trap.quantity + " is not finite";
      }
      context.report.add(figure);
      table.add_row({first ? trap.name : "", first ? trap.fails : "", first ? trap.predicts : "",
                     first ? trap.quantity : "", form.form, shown(form.value), shown(trap.limit), trap.unit});
      first = false;
    }
  }
  context.report.add_table("traps", "Published next to here", table);
  for (const Trap& trap : traps) {
    if (trap.plot_name.empty()) continue;
    context.report.say(trap.name + ": " + trap.fails + " (" + trap.predicts + ").");
    context.report.add_plot("trap_" + trap.plot_name, trap.plot, {640, 260});
  }
}

}  // namespace hapticd::study
