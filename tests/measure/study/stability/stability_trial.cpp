#include "tests/measure/study/stability/stability_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/sensor/nano17.h"
#include "rt/target/desired_force.h"
#include "rt/target/device_reach.h"
#include "rt/target/feasible_range.h"
#include "rt/target/largest_target.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kKnockedS = 2.05;  // after the hand began to press: the knock is over
constexpr double kJudgedS = 1.85;   // up to the next knock, and some to spare
constexpr double kWeightLetDownS = 2.0;
constexpr double kWeightSettlesS = 0.5;
constexpr double kWeightRaisedS = 1.0;
constexpr double kAnyChangeNPerS = 1e6;
constexpr double kGentleShare = 0.2;  // of the structural stiffness
constexpr double kSearchStep = 1.5;   // a band of instability that is narrower may be stepped over
constexpr double kMaxApproachS = 2.0;

sim::HandProgram hand_of(const StabilityTrial& trial) {
  if (trial.weight) {
    sim::HandProgram weight;
    weight.kind = sim::HandProgram::Kind::kWeight;
    weight.knock_n = trial.knock_n;
    return weight;
  }
  sim::HandProgram hand = pressing(trial.press_n);
  hand.force_rate_n_per_s = 8.0;
  hand.knock_n = trial.knock_n;
  hand.grip_stiffness_scale = trial.grip_stiffness_scale;
  hand.grip_damping_scale = trial.grip_damping_scale;
  return hand;
}

StabilityTrial trial_on(const std::string& device, const sim::ObjectModel& object, double rate_hz) {
  StabilityTrial trial;
  trial.rig.device = device;
  trial.rig.custom_device = sim::device_preset(device).value();
  trial.rig.object = object.name;
  trial.rig.custom_object = object;
  trial.rig.rate_hz = rate_hz;
  trial.rig.external_instrument = false;
  return trial;
}

double full_pull_n(const VirtualRun& run) {
  return std::min(run.scene().guard.max_force_n, rt::pull_within_sensor_n(run.info()));
}

}  // namespace

StabilityTrial tap_trial(const std::string& device, const sim::ObjectModel& object, double rate_hz) {
  StabilityTrial trial = trial_on(device, object, rate_hz);
  trial.scene.name = "tap_1d";
  trial.scene.max_target_stiffness_n_per_mm = rt::kMaxTargetNPerMm;
  return trial;
}

StabilityTrial explore_trial(const std::string& device, const sim::ObjectModel& object,
                             const rt::ObjectModel& model, double rate_hz) {
  StabilityTrial trial = trial_on(device, object, rate_hz);
  trial.rig.tip = "ball_bearing";
  trial.rig.tool_mass_g = kExploreToolMassG;
  trial.scene = explore_scene(rt::Tip::kBallBearing);
  trial.scene.max_target_stiffness_n_per_mm = std::min(
      rt::kMaxTargetNPerMm, rt::kMaxTargetOverObject * rt::stiffness_n_per_mm(model, kPressN).value());
  trial.model = model;
  return trial;
}

double granted_n_per_mm(const StabilityTrial& trial) {
  return std::min(trial.scene.max_target_stiffness_n_per_mm, compensable_n_per_mm(trial));
}

double compensable_n_per_mm(const StabilityTrial& trial) {
  const bool solved_for_force =
      trial.scene.structural_compensation && trial.scene.kind != rt::SceneKind::kExplore;
  if (!solved_for_force) return std::numeric_limits<double>::infinity();
  return rt::kMaxCompensableRatio * trial.device().structural_stiffness_n_per_mm;
}

double softest_feasible_n_per_mm(const StabilityTrial& trial) {
  static const double sensor_range_n = sim::Nano17(0.0, 1).info().range_n;
  const double device_n = std::min(trial.device().max_force_n, sensor_range_n - kPressN);
  return rt::feasible_range(trial.object_n_per_mm(), kPressN, device_n).min_n_per_mm;
}

TrialOutcome run_trial(const StabilityTrial& trial, double target_n_per_mm) {
  rt::SceneSpec scene = trial.scene;
  // A weight that is let down bounces on a hard target, where a hand's damping catches it.
  const double gentle =
      std::min(trial.object_n_per_mm(), kGentleShare * trial.device().structural_stiffness_n_per_mm);
  const double at_first = trial.weight ? std::min(target_n_per_mm, gentle) : target_n_per_mm;
  scene.target = rt::linear_target(at_first);
  scene.max_target_stiffness_n_per_mm = std::max(scene.max_target_stiffness_n_per_mm, target_n_per_mm);
  // Asked is whether the target is stable, not how a change towards it feels: it is there before the first
  // knock.
  scene.max_target_change_n_per_s = kAnyChangeNPerS;
  VirtualRun run(trial.rig, scene, true, trial.model ? &*trial.model : nullptr);
  run.set_hand(hand_of(trial));
  StabilityJudge judge(trial.rig.rate_hz);
  TrialOutcome outcome;
  bool latched = false;
  bool raised = !trial.weight;
  // Knocks count from the first touch; a weight's from the start, the first while it is still let down.
  double pressed_s = trial.weight ? kWeightLetDownS : -1.0;
  while (!latched) {
    run.step();
    if (!raised && run.time_s() >= kWeightLetDownS + kWeightSettlesS) {
      run.set_target(target_n_per_mm, kWeightRaisedS);
      raised = true;
    }
    latched = run.record().guard_state == rt::GuardState::kLatched;
    const hal::TruthSample& truth = run.truth();
    const double time_s = run.time_s();
    outcome.peak_n = std::max(outcome.peak_n, truth.normal_force_n);
    if (pressed_s < 0.0 && (truth.in_contact || time_s > kMaxApproachS)) pressed_s = time_s;
    if (latched || (pressed_s >= 0.0 && time_s >= pressed_s + kKnockedS)) {
      judge.add({truth.tip_position_mm.z, truth.normal_force_n, truth.in_contact, run.record().in_contact,
                 latched});
    }
    if (pressed_s >= 0.0 && time_s >= pressed_s + kKnockedS + kJudgedS) break;
  }
  outcome.at_full_pull =
      !latched && run.record().in_contact && run.record().commanded_force_n > 0.98 * full_pull_n(run);
  outcome.verdict = judge.verdict();
  outcome.swing_mm = judge.swing_mm();
  outcome.swing_n = judge.swing_n();
  return outcome;
}

double StableRange::margin(double target_n_per_mm) const {
  if (!any()) return 0.0;
  const double to_max = max_n_per_mm / target_n_per_mm;
  const double to_min = target_n_per_mm / min_n_per_mm;
  // An end that was not found does not limit what lies within.
  if (target_n_per_mm >= min_n_per_mm && !min_found) return to_max;
  return std::min(to_max, to_min);
}

StableRange find_stable_range(const StabilityTrial& trial, double floor, double start, double end,
                              double octaves) {
  const auto verdict = [&trial](double target) { return run_trial(trial, target).verdict; };
  StableRange range;
  range.at_start = verdict(start);
  range.beyond = range.below = range.at_start;
  double stable = start;
  double unstable_above = 0.0;  // the lowest known; 0 = none yet
  double unstable_below = 0.0;
  if (!is_stable(range.at_start)) {
    stable = 0.0;
    unstable_above = start;
    for (double target = start; stable == 0.0 && target > floor;) {
      target = std::max(floor, target / kSearchStep);
      const StabilityClass found = verdict(target);
      if (is_stable(found)) {
        stable = target;
      } else {
        unstable_above = target;
        range.beyond = found;
      }
    }
    if (stable == 0.0) {
      unstable_above = 0.0;
      unstable_below = start;
      range.below = range.at_start;
      for (double target = start; stable == 0.0 && target < std::min(end, 4.0 * start);) {
        target = std::min(end, kSearchStep * target);
        const StabilityClass found = verdict(target);
        if (is_stable(found)) {
          stable = target;
        } else {
          unstable_below = target;
          range.below = found;
        }
      }
    }
    if (stable == 0.0) return range;
  }
  range.max_n_per_mm = range.min_n_per_mm = stable;
  while (unstable_above == 0.0 && range.max_n_per_mm < end) {
    const double target = std::min(end, kSearchStep * range.max_n_per_mm);
    const StabilityClass found = verdict(target);
    if (is_stable(found)) {
      range.max_n_per_mm = target;
    } else {
      unstable_above = target;
      range.beyond = found;
    }
  }
  while (unstable_below == 0.0 && range.min_n_per_mm > floor) {
    const double target = std::max(floor, range.min_n_per_mm / kSearchStep);
    const StabilityClass found = verdict(target);
    if (is_stable(found)) {
      range.min_n_per_mm = target;
    } else {
      unstable_below = target;
      range.below = found;
    }
  }
  const auto close_in = [&](double& inside, double outside, StabilityClass& found_outside) {
    while (std::abs(std::log2(outside / inside)) > 1.01 * octaves) {
      const double target = std::sqrt(inside * outside);
      const StabilityClass found = verdict(target);
      if (is_stable(found)) {
        inside = target;
      } else {
        outside = target;
        found_outside = found;
      }
    }
  };
  range.max_found = unstable_above > 0.0;
  range.min_found = unstable_below > 0.0;
  if (range.max_found) close_in(range.max_n_per_mm, unstable_above, range.beyond);
  if (range.min_found) close_in(range.min_n_per_mm, unstable_below, range.below);
  return range;
}

std::vector<double> values_of(const StableRange& range) {
  return {range.max_n_per_mm,
          range.min_n_per_mm,
          range.max_found ? 1.0 : 0.0,
          range.min_found ? 1.0 : 0.0,
          static_cast<double>(range.beyond),
          static_cast<double>(range.below),
          static_cast<double>(range.at_start)};
}

StableRange range_of(const std::vector<double>& values) {
  const auto class_of = [](double value) { return static_cast<StabilityClass>(static_cast<int>(value)); };
  return {values.at(0),           values.at(1),           values.at(2) > 0.5,    values.at(3) > 0.5,
          class_of(values.at(4)), class_of(values.at(5)), class_of(values.at(6))};
}

}  // namespace hapticd::study
