#include <cmath>
#include <string>

#include "hal/sim/base/random.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/tumour/tumour_trial.h"

namespace hapticd::study {

namespace {

constexpr identification::Estimated kTipRadius{sim::PhantomParameters::kTipRadiusMm, 0.0};

}  // namespace

void run_inclusion_place(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"inclusion", "x, y, depth mm", "N/mm", "data", "off across mm",
                               "off in depth mm", "said ± across", "said ± depth"});
  sim::Random random(16);
  const int count = context.quick ? 2 : 10;
  for (int i = 0; i < count; ++i) {
    const double x = 24.0 * (random.uniform() - 0.5), y = 24.0 * (random.uniform() - 0.5);
    const double depth = 20.0 + 10.0 * random.uniform();
    const double stiffness = 0.21 + 0.33 * random.uniform();
    const sim::ObjectModel phantom = phantom_with_inclusion_at(x, y, depth, stiffness);
    const hal::Vector3 axis = phantom.phantom->inclusion->axis;
    const auto scan = scan_presses(24.0, 8.0, 13.0);
    const auto with = palpate_phantom(phantom, scan);
    for (const bool pair : {true, false}) {
      std::vector<identification::Press> without;
      if (pair)
        without =
            palpate_phantom(phantom_object("phantom"), {{0, 0, 11, 60}, {10, 0, 11, 60}, {0, 20, 11, 60}});
      const auto fit = identification::fit_inclusion_scan(without, with, {}, kTipRadius);
      report::Figure figure{"inclusion_place_error_mm",
                            {{"inclusion", std::to_string(i)}, {"data", pair ? "pair" : "one_phantom"}}};
      report::Figure deep = figure;
      figure.conditions.emplace_back("direction", "across");
      deep.conditions.emplace_back("direction", "depth");
      if (!fit) continue;
      const hal::Vector3 centre{0.0, 0.0, -sim::PhantomParameters::kRadiusMm};
      const hal::Vector3 from = fit->place_mm - centre;
      const double across_mm = rt::norm(from - axis * dot(from, axis));
      const double depth_mm = fit->depth_mm.value - depth;
      figure.value = across_mm;
      deep.value = std::abs(depth_mm);
      context.report.add(figure);
      context.report.add(deep);
      table.add_row({std::to_string(i), fixed(x, 1) + ", " + fixed(y, 1) + ", " + fixed(depth, 1),
                     fixed(stiffness, 2), pair ? "pair" : "one phantom", fixed(across_mm, 2),
                     fixed(depth_mm, 2),
                     fixed(std::hypot(fit->place_x_mm.standard_error, fit->place_y_mm.standard_error), 2),
                     fixed(fit->depth_mm.standard_error, 2)});
    }
  }
  context.report.add_table("inclusion_place", "Places of inclusions from a palpation scan", table,
                           "37 presses of 13 mm on a grid of 8 mm; nothing is known of the place.");
}

}  // namespace hapticd::study
