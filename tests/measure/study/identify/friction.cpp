#include <string>
#include <vector>

#include "server/identification/session/friction_identification.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/simulated_session.h"
#include "tests/measure/study/identify/friction_validation.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::value_of;

using report::fixed;
using report::significant;

constexpr double kLimitS = 90.0;
constexpr double kValidationMm = 50.0;

/// Error of the dissertation's rod (D§4.4.1).
double published_error(const std::string& object) {
  if (object == "sponge_cut") return 0.08;
  if (object == "foam_ball_3d") return 0.07;
  return object == "rubber_ball_3d" ? 0.10 : 0.15;
}
constexpr double kPublishedBearingError = 0.07;

/// Judged on other strokes, and added.
void study(StudyContext& context, const std::string& object, rt::Tip tip, double published,
           report::MarkdownTable& table) {
  const std::string tip_name = tip == rt::Tip::kRod ? "rod" : "ball_bearing";
  const sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, tip_name);
  identification::FrictionTask task;
  task.tip = tip;
  task.exponent_is_one = true;
  identification::FrictionIdentification identification(task, value_of(create_rig(config))->info());
  const SessionResult session = run_session(identification, config, kLimitS);
  const auto model = identification.finish();
  report::Figure figure{"friction_error", {{"object", object}, {"tip", tip_name}}};
  figure.goal = published;
  figure.reference = published;
  figure.source = "D§4.4.1";
  if (model) {
    const rt::FrictionParameters& p = std::get<rt::FrictionModel>(model->content).friction;
    figure.value = friction_error(validation_strokes(object, tip_name, kValidationMm), p);
    table.add_row({object, tip_name, fixed(100.0 * *figure.value, 1), fixed(100.0 * published, 0),
                   significant(p.kinetic), significant(p.presliding_mm), significant(p.viscous_n_s_per_mm, 2),
                   session.converged_s >= 0.0 ? fixed(session.converged_s, 1) : "no"});
  } else {
    figure.failed = model.error().text();
  }
  context.report.add(figure);
}

}  // namespace

void run_identify_friction(StudyContext& context) {
  report::MarkdownTable table(
      {"object", "tip", "error %", "D %", "μ_k", "δ mm", "μ_b N·s/mm", "converged s"});
  for (const std::string& object : explored_objects()) {
    if (context.quick && object != "foam_ball_3d") continue;
    study(context, object, rt::Tip::kRod, published_error(object), table);
  }
  std::vector<std::string> objects{"sponge_cut",    "foam_ball_3d", "rubber_ball_3d",
                                   "silicone_rest", "sponge_block", "rubber_eraser"};
  if (context.quick) objects.resize(3);
  for (const std::string& object : objects) {
    study(context, object, rt::Tip::kBallBearing, kPublishedBearingError, table);
  }
  context.report.add_table(
      "friction", "Friction of the rod and of the ball bearing", table,
      "Identified by light taps and strokes that the identification itself asked for; judged on other "
      "strokes "
      "(50 mm, 2-4 N, 60-120 mm/s, another seed) against the true friction, turns included. Error: mean "
      "|predicted - true| over mean |true| while the tip moves by the encoders (above 2 mm/s).");
}

}  // namespace hapticd::study
