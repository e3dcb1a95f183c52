#include "tests/measure/study/loading/onset.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/object/object_model.h"
#include "rt/guard/fault_table.h"
#include "rt/signal/vector.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/loading/loading_study.h"
#include "tests/support/ticks/lateness.h"

namespace hapticd::study {

namespace {

using report::fixed;

constexpr double kDeepMm = 6.0;      // and as far from above
constexpr double kFirstMm = 2.0;     // what is drawn
constexpr double kOverMm = 0.3;      // of a slope
constexpr double kHeldMmPerS = 0.5;  // slower is a hold
constexpr double kFeltN = 0.002;     // of the device, below which nothing is rendered
constexpr double kWaitsS = 1.0;
constexpr double kSpeeds[] = {5.0, 20.0, 50.0, 80.0};

/// Steepest slope over kOverMm of what the hand feels beyond what moves its arm, while it presses: in a hold
/// the force ends exact.
double steepest(const std::vector<LoadingPoint>& points) {
  double slope = 0.0;
  std::size_t from = 0;
  for (const LoadingPoint& now : points) {
    while (from + 1 < points.size() && now.displacement_mm - points[from + 1].displacement_mm >= kOverMm)
      ++from;
    const double over_mm = now.displacement_mm - points[from].displacement_mm;
    if (over_mm < kOverMm || over_mm > 2.0 * kOverMm) continue;
    if (over_mm < kHeldMmPerS * (now.since_s - points[from].since_s)) continue;
    slope = std::max(slope, (now.hand_force_n - points[from].hand_force_n) / over_mm);
  }
  return slope;
}

std::vector<std::pair<std::string, double>> conditions_and_speeds() {
  std::vector<std::pair<std::string, double>> all;
  for (const char* conditions : {"clean", "lab"}) {
    for (const double speed : kSpeeds) all.emplace_back(conditions, speed);
  }
  return all;
}

double travel_s(double speed_mm_per_s) {
  return 1.875 * 2.0 * kDeepMm / speed_mm_per_s;
}

/// Lets the hand meet the surface; `look(run, since_s)` sees each tick in which the object is pressed, and
/// ends the press with false.
template <class Look>
void press_at(VirtualRun& run, double speed_mm_per_s, Look look) {
  // Down and up in free air first, as a hand does: a zero is known by that.
  run.set_hand(going_to(2.0 * kDeepMm, 0.0));
  while (run.time_s() < 0.5 * kWaitsS) run.step();
  run.set_hand(going_to(kDeepMm, 0.3 * kWaitsS));
  while (run.time_s() < kWaitsS) run.step();
  run.set_hand(going_to(-kDeepMm, travel_s(speed_mm_per_s)));
  const double began_s = run.time_s();
  while (run.time_s() < began_s + travel_s(speed_mm_per_s)) {
    run.step();
    if (run.truth().displacement_mm > 0.0 && !look(run, run.time_s() - began_s)) return;
  }
}

LoadingPoint felt_now(const hal::TruthSample& truth, double since_s) {
  return {since_s, truth.displacement_mm, -dot(truth.hand_force_n, truth.outward_normal), 0.0};
}

/// Keeps the points of a slope: each deeper than the one before, in the first half of the press.
void keep_deeper(std::vector<LoadingPoint>& points, const LoadingPoint& now) {
  if (now.displacement_mm < 0.5 * kDeepMm &&
      (points.empty() || now.displacement_mm > points.back().displacement_mm)) {
    points.push_back(now);
  }
}

/// Collects a press from true samples, whatever rig they come from.
class OnsetJudge {
 public:
  explicit OnsetJudge(double target_n_per_mm) : target_n_per_mm_(target_n_per_mm) {}

  /// Takes a tick in which the object is pressed; `command_n`: the force that the device was given.
  void take(const hal::TruthSample& truth, double command_n, double since_s) {
    if (!is_felt_ && command_n > kFeltN) {
      is_felt_ = true;
      outcome_.force_n = truth.normal_force_n;
      outcome_.depth_mm = truth.displacement_mm;
    }
    const LoadingPoint now = felt_now(truth, since_s);
    const std::size_t before = points_.size();
    keep_deeper(points_, now);
    if (points_.size() > before && now.displacement_mm < kFirstMm) {
      outcome_.first.push_back(now);
      object_slope_ = std::max(object_slope_, truth.normal_force_n / std::max(now.displacement_mm, kOverMm));
    }
  }
  OnsetOutcome outcome() const {
    OnsetOutcome outcome = outcome_;
    if (!is_felt_) outcome.failed = "nothing was rendered";
    outcome.slope_ratio = steepest(points_) / std::max(target_n_per_mm_, object_slope_);
    return outcome;
  }

 private:
  double target_n_per_mm_;
  OnsetOutcome outcome_;
  std::vector<LoadingPoint> points_;
  bool is_felt_ = false;
  double object_slope_ = 0.0;
};

std::string why_latched(const rt::TickRecord& record) {
  if (record.guard_state != rt::GuardState::kLatched) return {};
  return "the guard latched: " + std::string(rt::rule_of(record.guard_fault).name);
}

rt::SceneSpec scene_of(const LoadingTrial& trial) {
  rt::SceneSpec scene = trial.scene;
  scene.target = rt::linear_target(trial.target_n_per_mm);
  return scene;
}

OnsetOutcome meet_live_once(const LoadingTrial& trial, double speed_mm_per_s, double& longest_pause_ms) {
  test::EmulatedRigConfig config;
  config.simulation = trial.rig;
  config.scene = scene_of(trial);
  config.scene.guard.sensor_stale_after_ms = kStallMs;
  config.model = trial.model ? &*trial.model : nullptr;
  config.late_us = test::lateness_us(30'000, {{500, 500.0}, {3'000, 5'000.0}});
  test::EmulatedRig run(config);
  run.set_hand(going_to(2.0 * kDeepMm, 0.0));
  run.pass(0.5 * kWaitsS);
  run.set_hand(going_to(kDeepMm, 0.3 * kWaitsS));
  run.pass(0.5 * kWaitsS);
  const std::size_t from = run.bench().truth_count();
  run.set_hand(going_to(-kDeepMm, travel_s(speed_mm_per_s)));
  run.pass(travel_s(speed_mm_per_s) + 0.1);

  longest_pause_ms = run.bench().longest_pause_ms();
  OnsetOutcome latched;
  for (const rt::TickRecord& record : run.records()) {
    latched.failed = why_latched(record);
    if (!latched.failed.empty()) return latched;
  }
  OnsetJudge judge(trial.target_n_per_mm);
  const std::vector<emulators::BenchTruth> truths = run.bench().truth_from(from);
  for (const emulators::BenchTruth& now : truths) {
    if (!(now.truth.displacement_mm > 0.0)) continue;
    judge.take(now.truth, rt::norm(now.asked_force_n),
               1e-9 * static_cast<double>(now.time_ns - truths.front().time_ns));
  }
  return judge.outcome();
}

}  // namespace

double slope_ratio_of_real(const LoadingTrial& trial, double speed_mm_per_s) {
  sim::SimulationConfig rig = trial.rig;
  sim::ObjectModel object = sim::object_preset("sponge_block").value();
  object.material = {};
  object.material.stiffness_at_4n_n_per_mm = trial.target_n_per_mm;
  rig.object = "sponge_block";
  rig.custom_object = object;
  const OnPlant linear(sim::Plant::kSeparable);
  VirtualRun run(rig, tap_loading(rig.device, rig.object, trial.target_n_per_mm).scene, false);
  std::vector<LoadingPoint> points;
  press_at(run, speed_mm_per_s, [&](const VirtualRun& now, double since_s) {
    keep_deeper(points, felt_now(now.truth(), since_s));
    return true;
  });
  return steepest(points) / trial.target_n_per_mm;
}

OnsetOutcome meet(const LoadingTrial& trial, double speed_mm_per_s) {
  VirtualRun run(trial.rig, scene_of(trial), true, trial.model ? &*trial.model : nullptr);
  OnsetJudge judge(trial.target_n_per_mm);
  OnsetOutcome latched;
  press_at(run, speed_mm_per_s, [&](const VirtualRun& seen, double since_s) {
    latched.failed = why_latched(seen.record());
    judge.take(seen.truth(), rt::norm(seen.record().device_command_n), since_s);
    return latched.failed.empty();
  });
  return latched.failed.empty() ? judge.outcome() : latched;
}

OnsetOutcome meet_live(const LoadingTrial& trial, double speed_mm_per_s) {
  constexpr int kMaxAttempts = 3;
  double pause_ms = 0.0;
  for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
    OnsetOutcome outcome = meet_live_once(trial, speed_mm_per_s, pause_ms);
    if (pause_ms <= kStallMs) return outcome;
  }
  OnsetOutcome stalled;
  stalled.failed = "the machine stalled for " + fixed(pause_ms, 0) + " ms";
  return stalled;
}

namespace {

/// Adds the figures of a press; `real_ratio`: slope_ratio_of_real().
void add_figures(StudyContext& context, const LoadingCase& c, const std::string& conditions, double speed,
                 const std::string& rig, const OnsetOutcome& outcome, double real_ratio) {
  const auto add = [&](const char* name, double value, std::optional<double> goal) {
    report::Figure figure{name,
                          {{"device", c.device},
                           {"object", c.object},
                           {"target", c.target_n_per_mm},
                           {"dims", c.dims},
                           {"speed_mm_per_s", speed},
                           {"conditions", conditions},
                           {"rig", rig}}};
    figure.goal = goal;
    figure.source = "D§3.4.3";
    if (outcome.failed.empty()) {
      figure.value = value;
    } else {
      figure.failed = outcome.failed;
    }
    context.report.add(figure);
  };
  add("onset_force_n", outcome.force_n, 0.10);
  add("onset_depth_mm", outcome.depth_mm, c.object.starts_with("sponge") ? 0.6 : 0.4);
  add("onset_slope_ratio", outcome.slope_ratio, 1.3 * real_ratio);
  add("onset_slope_of_real", real_ratio, std::nullopt);
  add("onset_slope_over_real", outcome.slope_ratio / real_ratio, 1.3);
}

std::vector<std::string> row_of(const LoadingCase& c, const std::string& conditions, double speed,
                                const OnsetOutcome& outcome, double real_ratio) {
  return {c.device,
          c.object,
          fixed(c.dims, 0),
          fixed(c.target_n_per_mm, 1),
          conditions,
          fixed(speed, 0),
          outcome.failed.empty() ? fixed(outcome.force_n, 3) : outcome.failed,
          fixed(outcome.depth_mm, 2),
          fixed(outcome.slope_ratio, 2),
          fixed(real_ratio, 2)};
}

report::MarkdownTable onset_table() {
  return report::MarkdownTable({"device", "object", "dims", "target N/mm", "conditions", "mm/s",
                                "first force at N", "at mm", "steepest slope / target's", "real object's"});
}

}  // namespace

void run_onset(StudyContext& context) {
  report::MarkdownTable table = onset_table();
  report::Plot plot;
  plot.title = "A press with 20 mm/s, PHANToM 1.0, one dimension";
  plot.x = {"displacement", "mm"};
  plot.y = {"force at the hand", "N"};
  for (const LoadingCase& c : loading_cases(context.quick)) {
    for (const auto& [conditions, speed] : conditions_and_speeds()) {
      LoadingTrial trial = c.trial(10.0);
      trial.rig.conditions = conditions;
      const OnsetOutcome outcome = meet(trial, speed);
      const double real_ratio = slope_ratio_of_real(trial, speed);
      add_figures(context, c, conditions, speed, "sim", outcome, real_ratio);
      table.add_row(row_of(c, conditions, speed, outcome, real_ratio));
      if (c.device != "phantom_1_0" || c.dims != 1 || speed != 20.0 || conditions != "clean") continue;
      report::PlotSeries series{c.object + ", " + fixed(c.target_n_per_mm, 1) + " N/mm"};
      for (const LoadingPoint& point : outcome.first) series.add(point.displacement_mm, point.hand_force_n);
      plot.series.push_back(series);
    }
  }
  context.report.add_table(
      "onset", "How a contact begins to be felt", table,
      "The hand comes from free air and meets the surface at its highest speed. First force: true reaction "
      "and "
      "true displacement when the device gives more than 2 mN. Slope: the steepest of the hand's force over "
      "0.3 mm within the first 3 mm, over the target's, or over the object's if that is stiffer: below the "
      "first "
      "force the hand feels the object. What is slower than 0.5 mm/s is a hold. Real object's: what the same "
      "hand feels of a real, linear object of "
      "the "
      "target's stiffness, with the motors off: the device's mass and friction are in both.");
  context.report.add_plot("onset", plot);
}

void run_onset_live(StudyContext& context) {
  constexpr double kDriftNPerS = 0.001;
  report::MarkdownTable table = onset_table();
  for (const LoadingCase& c : loading_cases(true)) {
    if (context.quick && (c.device != "phantom_1_0" || c.target_n_per_mm != 0.7)) continue;
    for (const double speed : kSpeeds) {
      LoadingTrial trial = c.trial(10.0);
      trial.rig.condition_values["sensor_drift_n_per_s"] = kDriftNPerS;
      trial.rig.condition_values["sensor_drift_bound_n"] = 1.0;
      trial.rig.condition_values["sensor_drift_wanders"] = 0.0;
      const OnsetOutcome outcome = meet_live(trial, speed);
      const double real_ratio = slope_ratio_of_real(trial, speed);
      add_figures(context, c, "late ticks, drift", speed, "emulated", outcome, real_ratio);
      table.add_row(row_of(c, "late ticks, drift", speed, outcome, real_ratio));
    }
  }
  context.report.add_table(
      "onset_live", "How a contact begins to be felt, live", table,
      "As the other table, over the vendor's library and a Net F/T box in real time: the scheduler is late "
      "by "
      "half a millisecond twice a second and by 5 ms every three seconds, the sensor drifts by 1 mN/s on "
      "each "
      "axis. First force: what the library is asked for. A run in which the machine stalled is repeated.");
}

}  // namespace hapticd::study
