#include <algorithm>
#include <string>

#include "rt/target/desired_force.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/oscillation.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/loading/loading_study.h"
#include "tests/measure/study/stability/analytic_bound.h"

namespace hapticd::study {

namespace {

constexpr double kStiffest = 20.0;
constexpr double kDwellS = 2.0;  // at each target: a knock in the middle, then time for it to die away
constexpr double kStepRatio = 1.05;
// Dry friction holds a weight that nothing disturbs at almost any target: without a knock the sweep would
// measure the friction of the device, not the stability of the rendering. 1 N for 20 ms is a tap of a finger
// on the bench.
constexpr double kKnockN = 1.0;

struct Limit {
  double value = 0.0;   ///< largest stable target; 0 when even the start is not
  bool reached = true;  ///< false: stable up to the end of the sweep
  std::string why;      ///< what happens just beyond
};

/// Steps the run on and says what is wrong, if anything.
class Watch {
 public:
  Watch(VirtualRun& run, bool on_object) : run_(run), on_object_(on_object), judge_(1000.0) {}

  std::string advance(double until_s) {
    while (run_.time_s() < until_s) {
      run_.step();
      judge_.add(run_.truth().tip_position_mm.z);
      if (run_.record().guard_state == rt::GuardState::kLatched) {
        return run_.record().guard_fault == rt::GuardFault::kSensorSaturated ? "its blows saturate the sensor"
                                                                             : "the guard latches";
      }
      if (on_object_ && !run_.truth().in_contact) return "bounces off";
      // Resting on the object without being rendered does not count as stability of the rendering.
      if (on_object_ && !run_.record().in_contact) return "contact is lost to the detector";
    }
    // Only now: what the last step set off has had its time to die away.
    if (judge_.oscillates()) return "oscillates by " + report::significant(judge_.peak_to_peak(), 2) + " mm";
    return "";
  }

 private:
  VirtualRun& run_;
  bool on_object_;
  OscillationJudge judge_;
};

/// Raises the target from `start` until something happens, as D§3.3.2 did; the limit is the target before
/// that step.
Limit sweep(VirtualRun& run, bool on_object, double start, double end) {
  Watch watch(run, on_object);
  std::string wrong = watch.advance(run.time_s() + 2.0);
  if (!wrong.empty()) return {0.0, true, wrong};
  for (double target = start; target < end;) {
    const double next = std::min(end, kStepRatio * target);
    run.set_target(next, 0.5);
    wrong = watch.advance(run.time_s() + kDwellS);
    if (!wrong.empty()) return {target, true, wrong};
    target = next;
  }
  wrong = watch.advance(run.time_s() + 2.0);
  if (!wrong.empty()) return {end / kStepRatio, true, wrong};
  return {end, false, ""};
}

sim::HandProgram knocked_weight() {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kWeight;
  hand.knock_n = kKnockN;
  return hand;
}

/// The passive weight of D§3.3.2: lowered onto the object, then the target is raised. If it bounces while it
/// is being lowered, it is lowered onto a softer target instead. `compensated`: structure. `damped`: without
/// the compensations that take damping away, the reaction's lead and the device's dry friction.
Limit object_limit(const sim::SimulationConfig& rig, bool compensated, bool damped = false) {
  const double object = sim::object_preset(rig.object)->material.stiffness_at_4n_n_per_mm;
  const double structural = sim::device_preset(rig.device)->structural_stiffness_n_per_mm;
  const double end = compensated ? rt::kMaxCompensableRatio * structural : std::max(kStiffest, 4.0 * object);
  Limit limit;
  for (const double softened : {1.0, 0.7, 0.5, 0.35, 0.25}) {
    rt::SceneSpec scene;
    scene.name = "tap_1d";
    scene.max_target_stiffness_n_per_mm = 1000.0;
    scene.structural_compensation = compensated;
    if (damped) leave_uncompensated(scene);
    scene.target.stiffness_n_per_mm = std::min(end, softened * object);
    VirtualRun run(rig, scene);
    run.set_hand(knocked_weight());
    while (run.time_s() < 3.0) run.step();  // odd: each dwell has its knock in the middle
    limit = sweep(run, true, scene.target.stiffness_n_per_mm, end);
    if (limit.value > 0.0) break;
  }
  return limit;
}

/// A hand that presses 4 N on a virtual wall, with the same knocks: a wall has no damping, so that a bare
/// weight would bounce on it for ever.
Limit wall_limit(const sim::SimulationConfig& rig, rt::ControlLaw law) {
  constexpr double kSoftWall = 0.3;
  rt::SceneSpec scene;
  scene.name = "wall";
  scene.kind = rt::SceneKind::kWall;
  scene.max_target_stiffness_n_per_mm = 1000.0;
  scene.structural_compensation = false;
  scene.controller.law = law;
  scene.target.stiffness_n_per_mm = kSoftWall;
  VirtualRun run(rig, scene);
  sim::HandProgram hand = pressing(4.0);
  hand.knock_n = kKnockN;
  run.set_hand(hand);
  while (run.time_s() < 8.0) run.step();
  return sweep(run, false, kSoftWall, kStiffest);
}

std::string shown(const Limit& limit) {
  if (limit.value == 0.0) return "none";
  return (limit.reached ? "" : "≥ ") + report::fixed(limit.value, 2);
}

void add_limit(StudyContext& context, report::Figure figure, const Limit& limit) {
  figure.unit = "N/mm";
  if (limit.value > 0.0) {
    figure.value = limit.value;
  } else {
    figure.failed = "unstable at every target it was lowered onto: " + limit.why;
  }
  context.report.add(figure);
}

void run_objects(StudyContext& context) {
  report::MarkdownTable table({"device", "object", "object N/mm", "limit, compensated", "beyond",
                               "limit, rigid", "beyond it", "rigid and damped", "beyond it", "bound"});
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    const sim::DeviceModel model = *sim::device_preset(device);
    const double kp = device == "phantom_1_0" ? 0.45 : 1.05;
    for (const std::string object :
         {"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser", "wood_plate"}) {
      if (context.quick && object != "sponge_block" && object != "wood_plate") continue;
      sim::SimulationConfig rig;
      rig.device = device;
      rig.object = object;
      const Limit compensated = object_limit(rig, true);
      const Limit rigid = object_limit(rig, false);
      const Limit damped = object_limit(rig, false, true);
      const sim::ObjectModel place = *sim::object_preset(object);
      // A weight damps nothing, and the surface's viscosity is part of the force that is cancelled.
      const double bound =
          analytic_bound_n_per_mm(loop_delays(1000.0, kp, model.amplifier_pole_hz, model.command_latency_s),
                                  place.material.stiffness_at_4n_n_per_mm, model.viscous_friction_n_s_per_mm);
      report::Figure figure{"stable_stiffness_max", {{"device", device}, {"object", object}}};
      figure.source = "D§3.3.2, 408 g weight";
      add_limit(context, figure, compensated);
      figure.figure = "stable_stiffness_max_rigid";
      add_limit(context, figure, rigid);
      figure.figure = "stable_stiffness_max_rigid_damped";
      add_limit(context, figure, damped);
      table.add_row({device, object, report::fixed(place.material.stiffness_at_4n_n_per_mm, 2),
                     shown(compensated), compensated.why, shown(rigid), rigid.why, shown(damped), damped.why,
                     report::fixed(bound, 2)});
    }
  }
  context.report.add_table(
      "stability", "Largest stable target stiffness under a 408 g weight, N/mm", table,
      "The target rises in steps of 5 % every two seconds, with a knock of 1 N for 20 ms at each, until the "
      "weight oscillates visibly (0.1 mm) without dying away, bounces off, or the "
      "guard latches. Compensated: the sweep ends at 0.8 of the structural stiffness. Damped: neither the "
      "reaction's lead nor the "
      "compensation of dry friction, which a hand can spare and a bare weight cannot. Bound: (b + τ_f k)/τ_x "
      "with k at 4 N and b the device's viscosity.");
}

void run_walls(StudyContext& context) {
  report::MarkdownTable table({"device", "controller", "largest stable wall N/mm", "dissertation", "beyond"});
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (const rt::ControlLaw law : {rt::ControlLaw::kOpenLoop, rt::ControlLaw::kClosedLoop}) {
      const bool open = law == rt::ControlLaw::kOpenLoop;
      sim::SimulationConfig rig;
      rig.device = device;
      rig.object = "none";
      const Limit limit = wall_limit(rig, law);
      report::Figure figure{"wall_stiffness_max",
                            {{"device", device}, {"controller", open ? "open loop" : "closed loop"}}};
      figure.source = "D§3.3.2";
      std::string published = report::kNoNumber;
      if (device == "phantom_1_0") figure.reference = open ? 1.0 : 1.3;
      if (device != "phantom_1_0" && open) figure.reference = 8.0;
      if (figure.reference) published = "about " + report::fixed(*figure.reference, 1);
      add_limit(context, figure, limit);
      table.add_row({device, open ? "open loop" : "closed loop", shown(limit), published, limit.why});
    }
  }
  context.report.add_table("walls", "Largest stable virtual wall, a hand pressing 4 N, with the same knocks",
                           table);
}

}  // namespace

void run_stability(StudyContext& context) {
  run_objects(context);
  run_walls(context);
}

}  // namespace hapticd::study
