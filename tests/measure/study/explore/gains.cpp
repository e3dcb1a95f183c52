#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "rt/control/default_gains.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/oscillation.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

/// What a controller gain does to a weight of 408 g that rests on the object and is knocked (D§3.3.2).
struct Response {
  bool oscillates = false;
  double period_ms = 0.0;  ///< of the oscillation
};

Response respond(const sim::SimulationConfig& rig, const rt::ObjectModel& model, double target_n_per_mm,
                 const rt::ControllerParameters& gains) {
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  // Laid down on the object as it is, so that it does not bounce before the target is what is asked.
  scene.target = rt::linear_target(sim::object_preset(rig.object)->material.stiffness_at_4n_n_per_mm);
  scene.controller = gains;
  scene.seeks_ultimate_gain = true;
  scene.explore.passivity = false;        // it would hold what is to be found
  scene.compensation.back_drive = false;  // so would the lack of friction be, for a bare weight
  VirtualRun run(rig, scene, true, &model);
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kWeight;
  hand.knock_n = 1.0;
  run.set_hand(hand);
  while (run.time_s() < 3.0) run.step();
  run.set_target(target_n_per_mm, 0.5);
  while (run.time_s() < 4.0) run.step();
  OscillationJudge judge(1000.0);
  Response response;
  int crossings = 0;
  double slow = -run.truth().tip_position_mm.z;
  bool above = false;
  double first_s = 0.0, last_s = 0.0;
  while (run.time_s() < 7.9) {
    run.step();
    const double depth = -run.truth().tip_position_mm.z;
    judge.add(depth);
    slow += 0.01 * (depth - slow);
    const bool now_above = depth > slow;
    if (run.time_s() > 7.0 && now_above && !above) {
      if (crossings++ == 0) first_s = run.time_s();
      last_s = run.time_s();
    }
    above = now_above;
    if (run.record().guard_state == rt::GuardState::kLatched) {
      response.oscillates = true;
      return response;
    }
  }
  response.oscillates = judge.oscillates() || !run.record().in_contact;
  if (crossings > 1) response.period_ms = 1e3 * (last_s - first_s) / (crossings - 1);
  return response;
}

}  // namespace

void run_gains(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"device", "object", "target N/mm", "Kp from", "K_c", "T_c ms", "Kp = 0.6 K_c",
                               "Kd = Kp T_c/8 ms", "Kd admitted ms", "holds", "published Kp, Kd"});
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    const rt::ControllerParameters published = rt::default_gains(device);
    for (const std::string& object : explored_objects()) {
      if (context.quick && object != "foam_ball_3d") continue;
      const sim::SimulationConfig rig = explore_rig(device, object, "ball_bearing");
      const rt::ObjectModel& model = identified(object).model;
      // Hard enough that the loop matters, soft enough that some gain holds it.
      const double target = 3.0 * sim::object_preset(object)->material.stiffness_at_4n_n_per_mm;
      // With its observer the controller is a lag of (1/Kp - 1) periods: too little gain is too much delay,
      // so the search starts at the smallest gain that holds. Beyond Kp = 2 the controller oscillates by
      // itself.
      constexpr double kEnd = 1.99;
      double lowest = 0.0;  // of the widest range that holds
      double ultimate = kEnd;
      Response at_ultimate;
      double from = 0.0;  // of the range under way
      double widest = 0.0;
      for (double kp = 0.1; kp < kEnd * 1.08; kp *= 1.08) {
        const bool beyond = kp >= kEnd;
        const Response response = beyond
                                      ? Response{true, 0.0}
                                      : respond(rig, model, target, {rt::ControlLaw::kClosedLoop, kp, 0.0});
        if (!response.oscillates && from == 0.0) from = kp;
        if (!response.oscillates || from == 0.0) continue;
        if (kp / from > widest) {
          widest = kp / from;
          lowest = from;
          ultimate = std::min(kp, kEnd);
          at_ultimate = response;
        }
        from = 0.0;
      }
      report::Figure figure{"ultimate_gain", {{"device", device}, {"object", object}}};
      figure.reference = published.proportional_gain / 0.6;
      figure.source = "D§3.3.2: published Kp / 0.6; manually tuned further there";
      if (lowest == 0.0) {
        figure.failed = "no proportional gain holds the weight at " + fixed(target, 2) + " N/mm";
        context.report.add(figure);
        table.add_row({device, object, fixed(target, 2), "none", report::kNoNumber, report::kNoNumber,
                       report::kNoNumber, report::kNoNumber, report::kNoNumber, "no", ""});
        continue;
      }
      const double kp = 0.6 * ultimate;
      const double kd_ms = kp * at_ultimate.period_ms / 8.0;
      rt::ControllerParameters gains{rt::ControlLaw::kClosedLoop, kp, kd_ms};
      // Half of what the controller's own polynomial admits: at its edge it rings by itself.
      while (gains.derivative_gain_ms > 0.0) {
        const rt::ControllerParameters edge{gains.law, kp, 2.0 * gains.derivative_gain_ms};
        if (rt::gains_are_stable(edge, 1000.0)) break;
        gains.derivative_gain_ms *= 0.9;
        if (gains.derivative_gain_ms < 1e-3) gains.derivative_gain_ms = 0.0;
      }
      const bool holds = !respond(rig, model, target, gains).oscillates;
      figure.value = ultimate;
      context.report.add(figure);
      table.add_row({device, object, fixed(target, 2), fixed(lowest, 2),
                     (ultimate < kEnd ? "" : "≥ ") + fixed(ultimate, 2),
                     at_ultimate.period_ms > 0.0 ? fixed(at_ultimate.period_ms, 1) : report::kNoNumber,
                     fixed(kp, 2), fixed(kd_ms, 2), fixed(gains.derivative_gain_ms, 2), holds ? "yes" : "no",
                     fixed(published.proportional_gain, 2) + ", " + fixed(published.derivative_gain_ms, 3)});
    }
  }
  context.report.add_table("gains", "Ultimate-gain search (Ziegler and Nichols, D§3.3.2)", table,
                           "Kp rises with Kd = 0 until the 408 g weight, knocked with 1 N, keeps "
                           "oscillating; target three times the object's stiffness. "
                           "The rule's Kd, taken per second as (3.6) is written, lies far outside the "
                           "controller's own stable region; what is admitted is half of "
                           "what that region allows.");
}

}  // namespace hapticd::study
