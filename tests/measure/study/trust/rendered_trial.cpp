#include "tests/measure/study/trust/rendered_trial.h"

#include <array>
#include <string>
#include <utility>

#include "rt/signal/vector.h"
#include "tests/measure/report/markdown_table.h"
#include "tests/measure/study/common/hands.h"

namespace hapticd::study {

using report::fixed;

namespace {

constexpr double kPressedN = 0.3;
constexpr double kRenderedN = 0.02;

void set_condition(sim::SimulationConfig& rig, const char* condition, double value) {
  rig.condition_values[condition] = value;
}

TrustCause cause(std::string name, std::string level, double value,
                 void (*apply)(sim::SimulationConfig& rig, double value)) {
  TrustCause made{.name = std::move(name), .level = std::move(level)};
  made.value = value;
  made.apply = apply;
  return made;
}

}  // namespace

const std::vector<TrustCause>& rendered_causes() {
  static const std::vector<TrustCause> all = [] {
    std::vector<TrustCause> list;
    static constexpr std::array<const char*, 3> kAxes{"bias_error_x_n", "bias_error_y_n", "bias_error_z_n"};
    for (const double mn : {16.0, 50.0, 100.0}) {
      for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
        constexpr std::array<void (*)(sim::SimulationConfig&, double), 3> kApply{
            [](sim::SimulationConfig& rig, double n) { set_condition(rig, kAxes[0], n); },
            [](sim::SimulationConfig& rig, double n) { set_condition(rig, kAxes[1], n); },
            [](sim::SimulationConfig& rig, double n) { set_condition(rig, kAxes[2], n); }};
        list.push_back(
            cause("zero_off", fixed(mn, 0) + " mN, " + std::string(1, "xyz"[axis]), 1e-3 * mn, kApply[axis]));
      }
    }
    for (const double mn_per_s : {1.0, 2.0, 5.0}) {
      list.push_back(cause("zero_drift", fixed(mn_per_s, 0) + " mN/s", 1e-3 * mn_per_s,
                           [](sim::SimulationConfig& rig, double n) {
                             set_condition(rig, "sensor_drift_n_per_s", n);
                             set_condition(rig, "sensor_drift_bound_n", 0.3);
                           }));
    }
    list.push_back(cause("lab", "", 0.0, [](sim::SimulationConfig& rig, double) { rig.conditions = "lab"; }));
    return list;
  }();
  return all;
}

namespace {

/// Waves the tool and presses eight times, with 30 mm/s, up to 2 N.
std::vector<Act> acts(double& until_s) {
  sim::HandProgram wave;
  wave.place_mm = {0.0, 0.0, 40.0};
  wave.kind = sim::HandProgram::Kind::kSway;
  wave.rate_hz = 1.0;
  wave.speed_mm_per_s = 60.0;
  wave.hold_s = 2.0;
  sim::HandProgram press = pressing(2.0);
  press.force_rate_n_per_s = 4.0;
  press.approach_mm_per_s = 30.0;
  press.hold_s = 1.5;
  press.repetitions = 8;
  until_s = 4.0 + sim::planned_duration_s(press);
  return {{0.0, wave}, {4.0, press}};
}

}  // namespace

RenderedShare rendered_share(const TrustCase& trial, const TrustModels& models) {
  sim::SimulationConfig rig = trust_rig(trial);
  rig.object = trial.scene == "tap_1d" ? "rubber_ball" : "foam_ball_3d";
  double until_s = 0.0;
  std::vector<Act> program = acts(until_s);
  TrustRun run(trial, models, rig, trust_scene(trial), std::move(program));
  RenderedShare share;
  while (run.now_s < until_s) {
    run.step();
    if (run.truth.normal_force_n < kPressedN) continue;
    const double passed_s = run.now_s - run.before_s;
    share.pressed_s += passed_s;
    if (rt::norm(run.record.device_command_n) > kRenderedN) share.rendered_s += passed_s;
  }
  return share;
}

}  // namespace hapticd::study
