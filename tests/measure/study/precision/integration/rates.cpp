#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "rt/control/default_gains.h"
#include "rt/scene/compose.h"
#include "tests/measure/report/run_time.h"
#include "tests/measure/report/work_precision.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/press.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

using report::fixed;
using report::significant;

constexpr const char* kDevice = "phantom_1_0";
constexpr double kShippedHz = 1000.0;

PressTask press_at(double rate_hz, const std::string& object, double target, double force_n,
                   double force_rate_n_per_s) {
  PressTask task = tap_press(kDevice, object, target, true, force_n);
  task.rig.rate_hz = rate_hz;
  task.hand.force_rate_n_per_s = force_rate_n_per_s;
  task.scene.controller = rt::default_gains(kDevice);
  return task;
}

/// Mean |hand force/(k~ x) - 1| while the force builds up, beyond a tenth of the final depth.
double pressing_error(const PressTask& task, const PressOutcome& outcome) {
  const double target = task.scene.target.stiffness_n_per_mm;
  const double min_mm = 0.1 * task.hand.force_n / target;
  double sum = 0.0;
  int counted = 0;
  for (const PressPoint& point : outcome.points) {
    if (point.since_s >= task.load_s()) break;
    if (point.depth_mm < min_mm) continue;
    sum += std::abs(point.hand_force_n / point.depth_mm / target - 1.0);
    ++counted;
  }
  return counted > 0 ? sum / counted : std::numeric_limits<double>::quiet_NaN();
}

/// How far the motors' force is from what would make the hand feel k~ x, f_r - k~ x, all by the truth: rms
/// over that of k~ x, while the force builds up and a little longer. Friction and inertia of the device,
/// which no rate changes, play no part.
struct DeviceForce {
  double error = std::numeric_limits<double>::quiet_NaN();
  /// Depth of the tip beyond what was believed when the contact was declared.
  double surface_too_deep_mm = std::numeric_limits<double>::quiet_NaN();
};

DeviceForce device_force_of(const PressTask& task) {
  VirtualRun run(task.rig, task.scene);
  run.set_hand(task.hand);
  constexpr double kTimeoutS = 10.0;
  constexpr double kAfterS = 0.1;
  double touched_s = -1.0;
  double error_squares = 0.0;
  double squares = 0.0;
  DeviceForce result;
  while (run.time_s() < kTimeoutS) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    if (touched_s < 0.0 && truth.in_contact) touched_s = run.time_s();
    if (!std::isfinite(result.surface_too_deep_mm) && run.record().in_contact) {
      result.surface_too_deep_mm = truth.displacement_mm - run.record().displacement_mm;
    }
    if (touched_s < 0.0) continue;
    if (run.time_s() > touched_s + task.load_s() + kAfterS) break;
    const double felt_n = task.scene.target.stiffness_n_per_mm * truth.displacement_mm;
    const double error_n = run.device_force_n() - (truth.normal_force_n - felt_n);
    error_squares += error_n * error_n;
    squares += felt_n * felt_n;
  }
  if (squares > 0.0) result.error = std::sqrt(error_squares / squares);
  return result;
}

/// Means over the cases.
struct Rendered {
  double device_force = 0.0;
  double surface_too_deep_mm = 0.0;
  double pressing = 0.0;
  double held = 0.0;  ///< |rendered/target - 1|
  std::string failed{};
};

Rendered rendered_at(double rate_hz, bool quick) {
  struct Case {
    const char* object;
    double target;
  };
  std::vector<Case> cases{{"rubber_ball", 0.3}, {"rubber_ball", 0.7}, {"foam_ball", 0.3}, {"foam_ball", 0.7}};
  if (quick) cases.resize(1);
  Rendered mean;
  for (const Case& c : cases) {
    const PressTask task = press_at(rate_hz, c.object, c.target, 1.0, 8.0);
    const PressOutcome outcome = press_direct(task);
    if (!outcome.failed.empty()) {
      mean.failed = std::string(c.object) + " at " + fixed(c.target, 1) + " N/mm: " + outcome.failed;
      return mean;
    }
    // A tick's place in encoder steps, tremor and noise is chance.
    const int seeds = quick ? 1 : 8;
    PressTask again = task;
    for (int seed = 1; seed <= seeds; ++seed) {
      again.rig.seed = static_cast<std::uint64_t>(seed);
      const DeviceForce force = device_force_of(again);
      const double share = 1.0 / (seeds * static_cast<double>(cases.size()));
      mean.device_force += share * force.error;
      mean.surface_too_deep_mm += share * force.surface_too_deep_mm;
    }
    mean.pressing += pressing_error(task, outcome) / static_cast<double>(cases.size());
    mean.held += std::abs(outcome.rendered_n_per_mm / c.target - 1.0) / static_cast<double>(cases.size());
  }
  return mean;
}

/// The renderer's computation alone, on the samples of a press.
double computation_ns_per_s(double rate_hz, bool quick) {
  const PressTask task = press_at(rate_hz, "rubber_ball", 0.7, 1.0, 8.0);
  std::vector<hal::RigSample> samples;
  VirtualRun run(task.rig, task.scene);
  run.set_hand(task.hand);
  const double duration_s = quick ? 1.0 : 2.5;
  while (run.time_s() < duration_s) {
    run.step();
    samples.push_back(run.sample());
  }
  const rt::SceneSpec& scene = run.scene();
  const std::unique_ptr<rt::Pipeline> pipeline = std::move(*rt::compose(scene, run.info()));
  rt::Renderer renderer(scene.guard, rate_hz);
  renderer.exchange(pipeline.get(), scene.guard);
  rt::TickRecord record;
  const double ns_per_tick = report::run_time_ns(
      samples.size(),
      [&] {
        double sum = 0.0;
        for (const hal::RigSample& sample : samples) {
          record = rt::TickRecord{};
          sum += renderer.tick(sample, record).force_n.z;
        }
        return sum;
      },
      quick ? 0.005 : 0.2);
  return ns_per_tick * rate_hz;
}

std::string rate_name(double rate_hz) {
  return significant(1e-3 * rate_hz, 1) + " kHz";
}

}  // namespace

void run_rate_precision(StudyContext& context) {
  const std::vector<double> rates_hz{500.0, 1000.0, 2000.0, 4000.0, 5000.0, 10000.0};
  report::WorkPrecision stage;
  stage.stage = "loop_rate";
  stage.justification =
      "half of it leaves more of the error at the hand while it presses and holds, see the table.";
  stage.error_name = "error of the device's force, of k~ x";
  stage.run_time_per = "second of rendering";
  stage.remark =
      "Scene tap_1d on PHANToM 1.0, eight seeds: rubber and foam ball at 0.3 and 0.7 N/mm, pressed to 1 N "
      "within "
      "0.23 s. True force of the motors less f_r - k~ x, which would make the hand feel k~ x.\nRun time: the "
      "renderer's ticks of one second, without driver or telemetry. Kept at every rate: Kp per tick, Kd in "
      "ms, thresholds in N; physics, sensor (10 kHz) and the device's latency (1 ms) do not change. At 4 kHz "
      "a "
      "tick has two or three physics steps by turns.";
  report::MarkdownTable table(
      {"rate", "device force error %", "surface too deep [µm]", "pressing error %", "held error %"});
  for (const double rate_hz : rates_hz) {
    const Rendered rendered = rendered_at(rate_hz, context.quick);
    report::Method method{rate_name(rate_hz)};
    method.is_default = rate_hz == kShippedHz;
    method.failed = rendered.failed;
    method.error = rendered.device_force;
    method.run_time_ns = computation_ns_per_s(rate_hz, context.quick);
    stage.methods.push_back(method);
    const auto percent = [&](double share) {
      return rendered.failed.empty() ? fixed(100.0 * share, 2) : rendered.failed;
    };
    table.add_row({rate_name(rate_hz), percent(rendered.device_force),
                   fixed(1e3 * rendered.surface_too_deep_mm, 0), percent(rendered.pressing),
                   percent(rendered.held)});
  }
  add_stage(context.report, stage);
  context.report.add_table(
      "loop_rate", "What a faster loop brings", table,
      "Surface: truth less estimate of the displacement when the contact is declared. Pressing error: mean "
      "|hand force/(k~ x) - 1| beyond a tenth of the final depth; held: after two seconds; both with the "
      "device's friction and inertia in them.");
  context.report.say(
      "A faster loop renders a little better, though the device's latency and amplifier do not get faster. "
      "What contact detection, velocity and direction count are times: they last as long, and see as little "
      "noise, at any rate. At 4 kHz ticks of two and three physics steps by turns, beating with the "
      "encoder's steps, look like jerk, and with it the force that counts as none grows: the simulator's "
      "doing, and what a loop with such jitter would get.");
}

}  // namespace hapticd::study
