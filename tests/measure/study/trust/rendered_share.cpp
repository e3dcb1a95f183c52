// How much of the time in which an object is pressed is rendered, whatever the sensor's zero does: silence
// wins nothing.

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/trust/rendered_trial.h"
#include "tests/measure/study/trust/trust_study.h"

namespace hapticd::study {

using report::fixed;

void run_rendered_share(StudyContext& context) {
  const std::uint64_t seeds = context.quick ? 1 : 20;
  std::vector<TrustCase> cases;
  for (const TrustCause& one : rendered_causes()) {
    for (const std::string scene : {"tap_1d", "explore_bearing"}) {
      for (const std::string& device : trust_devices()) {
        for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
          TrustCase trial;
          trial.cause = &one;
          trial.scene = scene;
          trial.device = device;
          trial.seed = seed;
          cases.push_back(trial);
        }
      }
    }
  }
  const TrustModels models{&identified("foam_ball_3d").model, nullptr};
  const auto cells = context.cells.values("trust_rendered", cases.size(), [&](std::size_t cell) {
    const RenderedShare share = rendered_share(cases[cell], models);
    return report::CellValues{share.pressed_s, share.rendered_s};
  });
  if (!cells) return;

  struct Sum {
    double pressed_s = 0.0;
    double rendered_s = 0.0;
    double lowest = 1.0;
  };
  std::map<std::array<std::string, 3>, Sum> by_case;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double pressed_s = (*cells)[i].at(0);
    const double rendered_s = (*cells)[i].at(1);
    const TrustCase& trial = cases[i];
    report::Figure figure{"rendered_share",
                          {{"cause", trial.cause->label()},
                           {"scene", trial.scene},
                           {"device", trial.device},
                           {"seed", static_cast<double>(trial.seed)}}};
    figure.goal = 0.99;
    if (pressed_s > 0.0) {
      figure.value = rendered_s / pressed_s;
    } else {
      figure.failed = "nothing was pressed";
    }
    context.report.add(figure);
    Sum& sum = by_case[{trial.cause->label(), trial.scene, trial.device}];
    sum.pressed_s += pressed_s;
    sum.rendered_s += rendered_s;
    sum.lowest = std::min(sum.lowest, figure.value.value_or(0.0));
  }
  report::MarkdownTable table({"cause", "scene", "device", "rendered", "lowest of the seeds"});
  for (const auto& [key, sum] : by_case) {
    table.add_row({key[0], key[1], key[2], fixed(100.0 * sum.rendered_s / sum.pressed_s, 1) + " %",
                   fixed(100.0 * sum.lowest, 1) + " %"});
  }
  context.report.add_table(
      "trust_rendered", "Share of the time in which an object is pressed that is rendered", table,
      "The tool is waved for some seconds, then presses eight times with 30 mm/s up to 2 N, and "
      "holds for 1.5 s. Pressed: the object pushes with more than 0.3 N. Rendered: the device "
      "gives more than 0.02 N.");
}

}  // namespace hapticd::study
