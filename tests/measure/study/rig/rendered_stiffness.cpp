#include <cmath>
#include <string>
#include <vector>

#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/rig_study.h"

namespace hapticd::study {

namespace {

struct PressResult {
  std::string infeasible;  ///< why device or sensor cannot do it at this hand force; empty = they can
  double rendered_n_per_mm = 0.0;
  double pressing_error_mean =
      0.0;  ///< mean |error| while the force builds up, beyond a tenth of the final depth
  std::vector<double> depth_mm;  ///< while the force builds up
  std::vector<double> hand_force_n;
};

/// Presses to `force_n`, holds three seconds, and reads force over displacement at the hand off the truth:
/// the mean of the last second. What the estimator believes plays no part.
PressResult press(const std::string& device, const std::string& object, double target, bool compensated,
                  double force_n) {
  const PressTask task = tap_press(device, object, target, compensated, force_n);
  const PressOutcome outcome = press_direct(task);
  PressResult result;
  result.infeasible = outcome.failed;
  if (!outcome.failed.empty()) return result;
  result.rendered_n_per_mm = outcome.rendered_n_per_mm;
  const double final_mm = force_n / target;
  double error_sum = 0.0;
  int counted = 0;
  int loading = -1;
  for (const PressPoint& point : outcome.points) {
    if (point.since_s >= task.load_s()) break;
    ++loading;
    if (point.depth_mm < 0.1 * final_mm) continue;
    const double error = point.hand_force_n / point.depth_mm / target - 1.0;
    error_sum += std::abs(error);
    ++counted;
    if (loading % 10 != 0) continue;
    result.depth_mm.push_back(point.depth_mm);
    result.hand_force_n.push_back(point.hand_force_n);
  }
  result.pressing_error_mean = counted > 0 ? error_sum / counted : 0.0;
  return result;
}

}  // namespace

PressTask tap_press(const std::string& device, const std::string& object, double target, bool compensated,
                    double force_n) {
  PressTask task;
  task.rig.device = device;
  task.rig.object = object;
  task.scene.name = "tap_1d";
  task.scene.target.stiffness_n_per_mm = target;
  task.scene.structural_compensation = compensated;
  task.hand = pressing(force_n);
  return task;
}

void run_rendered_stiffness(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"device", "object", "target N/mm", "press N", "rendered N/mm", "error %",
                               "pressing error %", "uncompensated error %"});
  report::Plot forces;
  forces.title = "Hand force over displacement, PHANToM 1.0: four objects, two targets";
  forces.x = {"displacement of the tip", "mm"};
  forces.y = {"force at the hand", "N"};

  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    const bool plotted = device == "phantom_1_0";
    // Friction of the device is felt by the hand; each device is pressed with a force that is some twenty to
    // thirty times it. Where (3.8) does not allow that much, with less.
    const double full_n = plotted ? 2.0 : 4.0;
    std::size_t colour = 0;
    for (const std::string& object : tapped_objects()) {
      ++colour;
      for (const double target : {0.3, 0.7}) {
        double force_n = full_n;
        PressResult with = press(device, object, target, true, force_n);
        while (!with.infeasible.empty() && force_n > 0.3) {
          force_n *= 0.5;
          with = press(device, object, target, true, force_n);
        }
        const PressResult without = press(device, object, target, false, force_n);
        const auto error_of = [target](const PressResult& result) {
          return result.infeasible.empty() ? fixed(100.0 * (result.rendered_n_per_mm / target - 1.0), 2)
                                           : std::string(report::kNoNumber);
        };
        for (const bool compensated : {true, false}) {
          report::Figure figure{"rendered_stiffness_error",
                                {{"device", device},
                                 {"object", object},
                                 {"target", target},
                                 {"compensation", compensated ? "structural" : "none"},
                                 {"transport", "direct"}}};
          figure.source = "D§3.3.2, D§4.6";
          if (plotted && compensated) figure.goal = 0.05;
          const PressResult& result = compensated ? with : without;
          if (result.infeasible.empty()) {
            figure.value = result.rendered_n_per_mm / target - 1.0;
          } else {
            figure.failed = result.infeasible + " at " + fixed(force_n, 2) + " N of hand force";
          }
          context.report.add(figure);
        }
        table.add_row({device, object, fixed(target, 1), fixed(force_n, 2),
                       with.infeasible.empty() ? fixed(with.rendered_n_per_mm, 4) : with.infeasible,
                       error_of(with), fixed(100.0 * with.pressing_error_mean, 2), error_of(without)});
        if (!plotted) continue;
        const std::string label = object + ", " + fixed(target, 1) + " N/mm";
        const bool dashed = target > 0.5;
        forces.series.push_back({label, cli::palette(colour),
                                 dashed ? report::PlotLine::kDashed : report::PlotLine::kSolid,
                                 cli::points_of(with.depth_mm, with.hand_force_n)});
      }
    }
  }
  context.report.add_table("rendered_stiffness", "Rendered stiffness at the hand", table,
                           "True hand force over true tip displacement, mean of the last second of a "
                           "three-second hold. Pressing error: mean "
                           "absolute error while the force builds up, beyond a tenth of the final depth. "
                           "Uncompensated: the device taken as "
                           "rigid.");
  context.report.add_plot("hand_force", forces);
}

}  // namespace hapticd::study
