#include <cmath>
#include <optional>

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

struct Identified {
  SessionResult session;
  std::optional<rt::IdentifiedModel> model;  ///< Dahl's exponent 1, or Coulomb-viscous
  std::string failed;
  std::vector<FrictionInstant> strokes;
};

Identified identified_on(const std::string& object, rt::Tip tip) {
  const std::string tip_name = tip == rt::Tip::kRod ? "rod" : "ball_bearing";
  const sim::SimulationConfig config = explore_rig("phantom_1_5_high_force", object, tip_name);
  const hal::RigInfo info = value_of(create_rig(config))->info();
  identification::FrictionTask task;
  task.tip = tip;
  task.exponent_is_one = true;
  identification::FrictionIdentification identification(task, info);
  Identified result;
  result.session = run_session(identification, config, kLimitS);
  auto model = identification.finish();
  if (!model) {
    result.failed = model.error().text();
    return result;
  }
  model->object = object;
  model->data_reference = "sim:" + object;
  result.model = *model;
  result.strokes = validation_strokes(object, tip_name, kValidationMm);
  return result;
}

const rt::FrictionParameters& friction_of(const rt::IdentifiedModel& model) {
  return std::get<rt::FrictionModel>(model.content).friction;
}

double error_of(const rt::IdentifiedModel& model, const std::string& name) {
  for (const rt::EstimatedParameter& p : model.parameters) {
    if (p.name == name) return p.standard_error;
  }
  return std::nan("");
}

std::string with_error(double value, double error, int digits = 3) {
  return significant(value, digits) + " ± " + significant(error, 1);
}

/// Error of the dissertation's rod (D§4.4.1).
double published_error(const std::string& object) {
  if (object == "sponge_cut") return 0.08;
  if (object == "foam_ball_3d") return 0.07;
  return object == "rubber_ball_3d" ? 0.10 : 0.15;
}
constexpr double kPublishedBearingError = 0.07;

void add_figure(StudyContext& context, const std::string& name, const std::string& object,
                const std::string& tip, std::optional<double> value, std::optional<double> reference,
                const std::string& failed) {
  report::Figure figure{name, {{"object", object}, {"tip", tip}}};
  figure.value = value;
  figure.goal = reference;
  figure.reference = reference;
  figure.source = "D§4.4.1";
  figure.failed = failed;
  context.report.add(figure);
}

void study_rod(StudyContext& context) {
  report::MarkdownTable table({"object", "error %", "D %", "sliding %", "at rest too %", "mean of ratios %",
                               "μ_k", "δ mm", "μ_b N·s/mm", "converged s"});
  for (const std::string& object : explored_objects()) {
    if (context.quick && object != "foam_ball_3d") continue;
    const double published = published_error(object);
    const Identified found = identified_on(object, rt::Tip::kRod);
    if (!found.model) {
      add_figure(context, "friction_error", object, "rod", std::nullopt, published, found.failed);
      continue;
    }
    const FrictionJudgement plain = judge_friction(found.strokes, friction_of(*found.model));
    add_figure(context, "friction_error", object, "rod", plain.error, published, "");
    const rt::FrictionParameters& p = friction_of(*found.model);
    table.add_row({object, fixed(100.0 * plain.error, 1), fixed(100.0 * published, 0),
                   fixed(100.0 * plain.sliding_error, 1), fixed(100.0 * plain.error_at_rest_too, 1),
                   fixed(100.0 * plain.mean_of_ratios, 1),
                   with_error(p.kinetic, error_of(*found.model, "kinetic")),
                   with_error(p.presliding_mm, error_of(*found.model, "presliding_mm")),
                   with_error(p.viscous_n_s_per_mm, error_of(*found.model, "viscous_n_s_per_mm"), 2),
                   found.session.converged_s >= 0.0 ? fixed(found.session.converged_s, 1) : "no"});
    for (const std::string& remark : found.session.progress.remarks)
      report::Report::note(object + ": " + remark);
    for (const std::string& word : found.session.progress.missing)
      report::Report::note(object + " misses: " + word);
  }
  context.report.add_table(
      "friction_rod", "Friction of the rod", table,
      "Identified by light taps and strokes that the identification itself asked for; judged on other "
      "strokes "
      "(50 mm, 2-4 N, 60-120 mm/s, another seed) against the true friction, turns included. Error: mean "
      "|predicted - true| over mean |true| while the tip moves by the encoders (above 2 mm/s); sliding: "
      "beyond "
      "3 mm after a turn and above 10 mm/s; at rest too: every instant, also where a turning hand winds the "
      "friction round and the encoders, held by the device's own, see nothing of it. Mean of ratios: mean of "
      "|predicted - true| / |true| where |true| "
      "is "
      "above a fifth of its mean.");
}

void study_bearing(StudyContext& context) {
  report::MarkdownTable table(
      {"object", "error %", "by D's constants %", "μ_k", "μ_b N·s/mm", "converged s"});
  std::vector<std::string> objects{"sponge_cut",    "foam_ball_3d", "rubber_ball_3d",
                                   "silicone_rest", "sponge_block", "rubber_eraser"};
  if (context.quick) objects.resize(3);
  for (const std::string& object : objects) {
    const Identified found = identified_on(object, rt::Tip::kBallBearing);
    if (!found.model) {
      add_figure(context, "friction_error", object, "ball_bearing", std::nullopt, kPublishedBearingError,
                 found.failed);
      continue;
    }
    const rt::FrictionParameters& p = friction_of(*found.model);
    const double error = judge_friction(found.strokes, p).error;
    add_figure(context, "friction_error", object, "ball_bearing", error, kPublishedBearingError, "");
    table.add_row({object, fixed(100.0 * error, 1),
                   fixed(100.0 * judge_friction(found.strokes, rt::kBallBearingFriction).error, 1),
                   with_error(p.kinetic, error_of(*found.model, "kinetic")),
                   with_error(p.viscous_n_s_per_mm, error_of(*found.model, "viscous_n_s_per_mm"), 2),
                   found.session.converged_s >= 0.0 ? fixed(found.session.converged_s, 1) : "no"});
    for (const std::string& word : found.session.progress.missing) {
      report::Report::note(object + " misses: " + word);
    }
  }
  context.report.add_table("friction_bearing", "Friction of the ball bearing", table,
                           "As for the rod; Coulomb-viscous. D's constants: 0.0643, 0.000244 N·s/mm on every "
                           "object.");
}

}  // namespace

void run_identify_friction(StudyContext& context) {
  study_rod(context);
  study_bearing(context);
}

}  // namespace hapticd::study
