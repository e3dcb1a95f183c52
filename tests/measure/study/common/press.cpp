#include "tests/measure/study/common/press.h"

#include "rt/guard/fault_table.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kTimeoutS = 30.0;
constexpr const char* kNeverTouched = "the hand never touched the object";
constexpr const char* kForceLimit =
    "the device's force limit, or what the sensor bears of it, is reached, (3.8)";

/// Why the device or the sensor cannot do it, by a tick of the press; empty = they can.
std::string failure(const rt::TickRecord& record, bool judging) {
  if (record.guard_state == rt::GuardState::kLatched) {
    if (record.guard_fault == rt::GuardFault::kSensorSaturated) return "the sensor saturates";
    return "the guard latched: " + std::string(rt::rule_of(record.guard_fault).name);
  }
  if (judging && record.guard_state != rt::GuardState::kRendering) return "the force was held back";
  if (judging && (record.guard_limits & rt::guard_limit::kForce) != 0) return kForceLimit;
  return {};
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

PressOutcome press_direct(const PressTask& task) {
  VirtualRun run(task.rig, task.scene, true, task.model);
  run.set_hand(task.hand);
  PressOutcome outcome;
  double touched_s = -1.0;
  double since_s = -1.0;
  double force_n = 0.0;
  double depth_mm = 0.0;
  while (since_s < task.load_s() + task.judged_to_s && run.time_s() < kTimeoutS && outcome.failed.empty()) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    if (touched_s < 0.0 && truth.in_contact) touched_s = run.time_s();
    if (touched_s >= 0.0) since_s = run.time_s() - touched_s;
    const bool judging = since_s > task.load_s() + task.judged_from_s;
    outcome.failed = failure(run.record(), judging);
    if (touched_s < 0.0 || truth.displacement_mm <= 0.0) continue;
    outcome.points.push_back({since_s, truth.displacement_mm, run.hand_force_n()});
    if (!judging) continue;
    force_n += run.hand_force_n();
    depth_mm += truth.displacement_mm;
  }
  if (touched_s < 0.0 && outcome.failed.empty()) outcome.failed = kNeverTouched;
  if (outcome.failed.empty() && depth_mm > 0.0) outcome.rendered_n_per_mm = force_n / depth_mm;
  return outcome;
}

}  // namespace hapticd::study
