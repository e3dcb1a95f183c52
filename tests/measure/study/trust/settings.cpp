#include <algorithm>
#include <string>
#include <vector>

#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/trust/settings_search.h"
#include "tests/measure/study/trust/trust_study.h"
#include "tests/support/free_air_judge.h"

namespace hapticd::study {

namespace {

using report::fixed;
using test::FreeAirJudge;

report::CellValues values_of(const SettingsOutcome& o) {
  return {o.scenes,     o.targets,    o.models,        o.refused, o.free_s,  o.free_air_max_n,
          o.longest_ms, o.step_max_n, o.contact_max_n, o.hardest, o.roughest};
}

}  // namespace

void run_settings(StudyContext& context) {
  const std::size_t searches = context.quick ? 8 : 800;
  const int scenes = context.quick ? 25 : 130;
  const IdentificationResult& foam = identified("foam_ball_3d");
  const auto cells = context.cells.values("trust_settings", searches, [&](std::size_t cell) {
    return values_of(search_settings(cell + 1, scenes, foam.model));
  });
  if (!cells) return;

  SettingsOutcome all;
  std::size_t hardest = 0;
  std::size_t roughest = 0;
  int failing = 0;
  for (std::size_t i = 0; i < cells->size(); ++i) {
    const report::CellValues& v = (*cells)[i];
    all.scenes += v[0];
    all.targets += v[1];
    all.models += v[2];
    all.refused += v[3];
    all.free_s += v[4];
    if (v[5] > all.free_air_max_n) {
      hardest = i;
      all.hardest = v[9];
    }
    all.free_air_max_n = std::max(all.free_air_max_n, v[5]);
    all.longest_ms = std::max(all.longest_ms, v[6]);
    if (v[7] > all.step_max_n) {
      roughest = i;
      all.roughest = v[10];
    }
    all.step_max_n = std::max(all.step_max_n, v[7]);
    all.contact_max_n = std::max(all.contact_max_n, v[8]);
    failing += v[5] > FreeAirJudge::kMaxN ? 1 : 0;
  }
  const report::Case conditions{{"settings", "accepted"}};
  const auto add = [&](const char* name, double value, const char* unit, std::optional<double> goal) {
    report::Figure figure{name, conditions};
    figure.value = value;
    figure.unit = unit;
    figure.goal = goal;
    figure.source = "scenes, targets and stored models drawn at random from all that is accepted";
    context.report.add(figure);
  };
  add("free_air_force_max_n", all.free_air_max_n, "N", FreeAirJudge::kMaxN);
  add("force_step_max_n", all.step_max_n, "N", std::nullopt);
  add("inputs_tried", all.inputs(), "1", std::nullopt);

  report::MarkdownTable table({"scenes", "targets", "stored models", "refused", "free air s",
                               "largest N in free air", "longest ms", "largest step N",
                               "largest N in contact", "searches failing"});
  table.add_row({fixed(all.scenes, 0), fixed(all.targets, 0), fixed(all.models, 0), fixed(all.refused, 0),
                 fixed(all.free_s, 0), fixed(all.free_air_max_n, 3), fixed(all.longest_ms, 1),
                 fixed(all.step_max_n, 3), fixed(all.contact_max_n, 2), std::to_string(failing)});
  context.report.add_table(
      "trust_settings", "All that is accepted, drawn at random", table,
      "Each scene is rendered for one tap or press and what follows it, exchanged in free air; targets are "
      "set "
      "in contact. Largest force in free air from 20 ms after a contact; most in search " +
          std::to_string(hardest + 1) + ", scene " + fixed(all.hardest, 0) + "; largest step in search " +
          std::to_string(roughest + 1) + ", scene " + fixed(all.roughest, 0) + ".");
}

}  // namespace hapticd::study
