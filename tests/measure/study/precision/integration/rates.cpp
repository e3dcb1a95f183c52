#include <cmath>
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
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

using report::significant;

constexpr const char* kDevice = "phantom_1_0";

PressTask press_at(double rate_hz, const std::string& object, double target) {
  PressTask task = tap_press(kDevice, object, target, true, 1.0);
  task.rig.rate_hz = rate_hz;
  task.hand.force_rate_n_per_s = 8.0;
  task.scene.controller = rt::default_gains(kDevice);
  return task;
}

/// How far the motors' force is from what would make the hand feel k~ x, f_r - k~ x, all by the truth: rms
/// over that of k~ x, while the force builds up and a little longer. Friction and inertia of the device,
/// which no rate changes, play no part.
double device_force_error(const PressTask& task) {
  VirtualRun run(task.rig, task.scene);
  run.set_hand(task.hand);
  constexpr double kTimeoutS = 10.0;
  constexpr double kAfterS = 0.1;
  double touched_s = -1.0;
  double error_squares = 0.0;
  double squares = 0.0;
  while (run.time_s() < kTimeoutS) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    if (touched_s < 0.0 && truth.in_contact) touched_s = run.time_s();
    if (touched_s < 0.0) continue;
    if (run.time_s() > touched_s + task.load_s() + kAfterS) break;
    const double felt_n = task.scene.target.stiffness_n_per_mm * truth.displacement_mm;
    const double error_n = run.device_force_n() - (truth.normal_force_n - felt_n);
    error_squares += error_n * error_n;
    squares += felt_n * felt_n;
  }
  return std::sqrt(error_squares / squares);
}

/// Mean over the cases and seeds: a tick's place in encoder steps, tremor and noise is chance.
double device_force_error_at(double rate_hz, bool quick) {
  const std::vector<std::pair<const char*, double>> all{
      {"rubber_ball", 0.3}, {"rubber_ball", 0.7}, {"foam_ball", 0.3}, {"foam_ball", 0.7}};
  const std::size_t cases = quick ? 1 : all.size();
  const int seeds = quick ? 1 : 8;
  double mean = 0.0;
  for (std::size_t i = 0; i < cases; ++i) {
    PressTask task = press_at(rate_hz, all[i].first, all[i].second);
    for (int seed = 1; seed <= seeds; ++seed) {
      task.rig.seed = static_cast<std::uint64_t>(seed);
      mean += device_force_error(task) / (seeds * static_cast<double>(cases));
    }
  }
  return mean;
}

/// The renderer's computation alone, on the samples of a press.
double computation_ns_per_s(double rate_hz, bool quick) {
  const PressTask task = press_at(rate_hz, "rubber_ball", 0.7);
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

}  // namespace

void run_rate_precision(StudyContext& context) {
  report::WorkPrecision stage;
  stage.stage = "loop_rate";
  stage.justification = "it is the rate that every device gives; a faster loop is hardly more exact.";
  stage.error_name = "error of the device's force, of k~ x";
  stage.run_time_per = "second of rendering";
  stage.remark =
      "Scene tap_1d on PHANToM 1.0, eight seeds: rubber and foam ball at 0.3 and 0.7 N/mm, pressed to 1 N "
      "within 0.23 s. True force of the motors less f_r - k~ x, which would make the hand feel k~ x.\nRun "
      "time: "
      "the renderer's ticks of one second, without driver or telemetry. Kept at every rate: Kp per tick, Kd "
      "in "
      "ms, thresholds in N; physics, sensor (10 kHz) and the device's latency (1 ms) do not change. At 4 kHz "
      "a "
      "tick has two or three physics steps by turns.";
  for (const double rate_hz : {500.0, 1000.0, 2000.0, 4000.0, 5000.0, 10000.0}) {
    stage.methods.push_back({significant(1e-3 * rate_hz, 1) + " kHz",
                             device_force_error_at(rate_hz, context.quick),
                             computation_ns_per_s(rate_hz, context.quick),
                             rate_hz == 1000.0,
                             {}});
  }
  add_stage(context.report, stage);
  context.report.say(
      "A faster loop renders a little better, though the device's latency and amplifier do not get faster. "
      "What contact detection, velocity and direction count are times: they last as long, and see as little "
      "noise, at any rate. At 4 kHz ticks of two and three physics steps by turns, beating with the "
      "encoder's steps, look like jerk, and with it the force that counts as none grows: the simulator's "
      "doing, and what a loop with such jitter would get.");
}

}  // namespace hapticd::study
