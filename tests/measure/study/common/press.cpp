#include "tests/measure/study/common/press.h"

#include <algorithm>

#include "rt/guard/fault_table.h"
#include "tests/emulated_rig/board_rig.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/measure/report/markdown_table.h"
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

void conclude(const PressJudge& judge, PressOutcome& outcome) {
  outcome.points = judge.points();
  if (!outcome.failed.empty()) return;
  if (!judge.touched()) {
    outcome.failed = kNeverTouched;
    return;
  }
  outcome.rendered_n_per_mm = judge.rendered_n_per_mm();
  outcome.swing_mm = judge.swing_mm();
}

double between_ms(std::int64_t from_ns, std::int64_t to_ns) {
  return 1e-6 * static_cast<double>(to_ns - from_ns);
}

PressOutcome press_once(const PressTask& task, Disturbance& disturbance) {
  test::EmulatedRigConfig config;
  config.simulation = task.rig;
  config.scene = task.scene;
  config.model = task.model;
  // A stall of the machine is this study's to find; it is repeated then, and no fault of the sensor's.
  config.scene.guard.sensor_stale_after_ms = kStallMs;
  test::EmulatedRig run(config);
  run.set_hand(task.hand);

  PressOutcome outcome;
  PressJudge judge(task);
  std::size_t taken = 0;
  std::int64_t touched_ns = 0;
  std::int64_t ended_ns = 0;
  std::int64_t before_ns = 0;
  run.until(
      [&] {
        for (; taken < run.bench().truth_count() && !judge.over(); ++taken) {
          const emulators::BenchTruth truth = run.bench().truth(taken);
          judge.take(1e-9 * static_cast<double>(truth.time_ns), truth.truth);
          if (!judge.touched()) continue;
          if (touched_ns == 0) touched_ns = before_ns = truth.monotonic_ns;
          disturbance.longest_world_gap_ms =
              std::max(disturbance.longest_world_gap_ms, between_ms(before_ns, truth.monotonic_ns));
          ended_ns = before_ns = truth.monotonic_ns;
        }
        return judge.over();
      },
      kTimeoutS);
  run.pass(0.01);

  const double judged_ms = 1e3 * (task.judged_to_s - task.judged_from_s);
  for (const rt::TickRecord& record : run.records()) {
    const std::size_t tick = static_cast<std::size_t>(record.tick);
    if (tick == 0 || tick >= run.rig().marks()) continue;
    const std::int64_t now_ns = run.rig().mark(tick).monotonic_ns;
    if (touched_ns == 0 || now_ns < touched_ns || now_ns > ended_ns) continue;
    disturbance.longest_tick_gap_ms =
        std::max(disturbance.longest_tick_gap_ms, between_ms(run.rig().mark(tick - 1).monotonic_ns, now_ns));
    disturbance.ticks_missed += record.timing.periods_missed;
    ++disturbance.ticks;
    if (outcome.failed.empty()) outcome.failed = failure(record, between_ms(now_ns, ended_ns) < judged_ms);
  }
  if (outcome.failed.empty() && !run.whole()) outcome.failed = "records of ticks were lost";
  conclude(judge, outcome);
  return outcome;
}

}  // namespace

void PressJudge::take(double time_s, const hal::TruthSample& truth) {
  const bool was_over = over();
  time_s_ = time_s;
  if (!touched() && truth.in_contact) touched_s_ = time_s;
  if (!touched() || truth.displacement_mm <= 0.0 || was_over) return;
  const double force_n = -truth.hand_force_n.z;
  points_.push_back({since_s(), truth.displacement_mm, force_n});
  if (!judging()) return;
  force_sum_n_ += force_n;
  depth_sum_mm_ += truth.displacement_mm;
  shallowest_mm_ = std::min(shallowest_mm_, truth.displacement_mm);
  deepest_mm_ = std::max(deepest_mm_, truth.displacement_mm);
}

PressOutcome press_direct(const PressTask& task) {
  VirtualRun run(task.rig, task.scene, true, task.model);
  run.set_hand(task.hand);
  PressOutcome outcome;
  PressJudge judge(task);
  while (!judge.over() && run.time_s() < kTimeoutS && outcome.failed.empty()) {
    run.step();
    judge.take(run.time_s(), run.truth());
    outcome.failed = failure(run.record(), judge.judging());
  }
  conclude(judge, outcome);
  return outcome;
}

PressOutcome press_on_board(const PressTask& task) {
  test::BoardRig run({task.rig, task.scene, task.model});
  run.set_hand(task.hand);
  PressOutcome outcome;
  PressJudge judge(task);
  run.until(
      [&] {
        judge.take(1e-9 * static_cast<double>(run.last().time_ns), run.truth());
        outcome.failed = failure(run.last(), judge.judging());
        return judge.over() || !outcome.failed.empty();
      },
      kTimeoutS);
  conclude(judge, outcome);
  return outcome;
}

LivePress press_emulated(const PressTask& task) {
  constexpr int kMaxAttempts = 3;
  LivePress press;
  while (press.attempts < kMaxAttempts) {
    ++press.attempts;
    press.disturbance = {};
    press.outcome = press_once(task, press.disturbance);
    const double gap_ms =
        std::max(press.disturbance.longest_tick_gap_ms, press.disturbance.longest_world_gap_ms);
    if (gap_ms <= kStallMs) return press;
    press.outcome.failed = "the machine stalled for " + report::fixed(gap_ms, 0) + " ms in each of " +
                           std::to_string(press.attempts) + " attempts";
  }
  return press;
}

}  // namespace hapticd::study
