#include "tests/measure/study/loading/loading_trial.h"

#include <algorithm>
#include <cmath>

#include "hal/sim/hand/hand_motion.h"
#include "rt/guard/fault_table.h"
#include "rt/target/largest_target.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kClearanceMm = 0.5;  // between the waiting tip and the surface
constexpr double kRestS = 1.0;
constexpr double kHoldS = 3.0;
constexpr double kHeldJudgedS = 1.0;
constexpr double kRateOverS = 0.02;

LoadingTrial trial_on(const std::string& device, const std::string& object, double target_n_per_mm) {
  LoadingTrial trial;
  trial.rig.device = device;
  trial.rig.object = object;
  trial.rig.custom_device = sim::device_preset(device).value();
  trial.rig.external_instrument = false;
  trial.target_n_per_mm = target_n_per_mm;
  return trial;
}

std::string failure(const rt::TickRecord& record) {
  if (record.guard_state == rt::GuardState::kLatched) {
    return "the guard latched: " + std::string(rt::rule_of(record.guard_fault).name);
  }
  if ((record.guard_limits & rt::guard_limit::kForce) != 0) {
    return "the device's force limit, or what the sensor bears of it, is reached, (3.8)";
  }
  return {};
}

double max_rate(const std::vector<double>& force_n, double rate_hz) {
  const auto over = static_cast<std::size_t>(std::lround(kRateOverS * rate_hz));
  double rate = 0.0;
  for (std::size_t i = over; i < force_n.size(); ++i) {
    rate = std::max(rate, (force_n[i] - force_n[i - over]) / kRateOverS);
  }
  return rate;
}

}  // namespace

sim::HandProgram going_to(double height_mm, double travel_s, double grip_stiffness_scale) {
  constexpr double kHandHomeMm = 10.0;  // of the simulated hand's programs
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kRest;
  hand.place_mm.z = height_mm - kHandHomeMm;
  hand.travel_s = travel_s;
  hand.grip_stiffness_scale = grip_stiffness_scale;
  return hand;
}

LoadingTrial tap_loading(const std::string& device, const std::string& object, double target_n_per_mm) {
  LoadingTrial trial = trial_on(device, object, target_n_per_mm);
  trial.scene.name = "tap_1d";
  return trial;
}

LoadingTrial explore_loading(const std::string& device, const std::string& object, double target_n_per_mm,
                             const rt::ObjectModel& model) {
  LoadingTrial trial = trial_on(device, object, target_n_per_mm);
  trial.rig.tip = "ball_bearing";
  trial.rig.tool_mass_g = kExploreToolMassG;
  trial.scene = explore_scene(rt::Tip::kBallBearing);
  trial.model = model;
  return trial;
}

LoadingOutcome press(const LoadingTrial& trial) {
  rt::SceneSpec scene = trial.scene;
  scene.target = rt::linear_target(trial.target_n_per_mm);
  VirtualRun run(trial.rig, scene, true, trial.model ? &*trial.model : nullptr);
  run.set_hand(going_to(kClearanceMm, 0.0, trial.grip_stiffness_scale));
  while (run.time_s() < kRestS) run.step();

  const sim::HandProgram resting = going_to(0.0, 0.0, trial.grip_stiffness_scale);
  const double final_mm = trial.force_n / trial.target_n_per_mm;
  const double leaned_mm = final_mm + trial.force_n / sim::impedance_of(resting).stiffness_n_per_mm;
  // The way through the air is gone at the same pace.
  const double travel_s = trial.load_s() * (1.0 + kClearanceMm / leaned_mm);
  run.set_hand(going_to(-leaned_mm, travel_s, trial.grip_stiffness_scale));

  LoadingOutcome outcome;
  std::vector<double> force_n;
  double held_n = 0.0;
  double held_mm = 0.0;
  const double began_s = run.time_s();
  while (run.time_s() < began_s + travel_s + kHoldS && outcome.failed.empty()) {
    run.step();
    const double since_s = run.time_s() - began_s;
    const hal::TruthSample& truth = run.truth();
    outcome.failed = failure(run.record());
    LoadingPoint now{since_s, truth.displacement_mm, -dot(truth.hand_force_n, truth.outward_normal), 0.0};
    if (since_s <= travel_s) {
      force_n.push_back(now.hand_force_n);
      if (now.displacement_mm < kJudgedBeyondShare * final_mm) continue;
      now.error = now.hand_force_n / (now.displacement_mm * trial.target_n_per_mm) - 1.0;
      outcome.loading.push_back(now);
    } else if (since_s > travel_s + kHoldS - kHeldJudgedS) {
      held_n += now.hand_force_n;
      held_mm += now.displacement_mm;
    }
  }
  outcome.max_rate_n_per_s = max_rate(force_n, trial.rig.rate_hz);
  if (outcome.failed.empty() && outcome.loading.empty()) outcome.failed = "the hand never pressed the object";
  if (!outcome.failed.empty()) return outcome;
  for (const LoadingPoint& point : outcome.loading) {
    outcome.error_mean += std::abs(point.error);
    outcome.error_signed += point.error;
  }
  outcome.error_mean /= static_cast<double>(outcome.loading.size());
  outcome.error_signed /= static_cast<double>(outcome.loading.size());
  outcome.error_held = held_n / (held_mm * trial.target_n_per_mm) - 1.0;
  return outcome;
}

}  // namespace hapticd::study
