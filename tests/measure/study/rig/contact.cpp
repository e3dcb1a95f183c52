#include <algorithm>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "rt/contact/contact_detector.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_compensation.h"
#include "tests/measure/report/quantile.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

struct Delays {
  std::vector<double> delay_ms;
  double speed_sum_mm_per_s = 0.0;
  int missed = 0;
  int false_alarms = 0;

  double mean_ms() const {
    return std::accumulate(delay_ms.begin(), delay_ms.end(), 0.0) / static_cast<double>(delay_ms.size());
  }
};

/// Taps an object. The true instant of contact is found between ticks from depth and speed at the first tick
/// inside.
Delays tap(const std::string& object, double speed_mm_per_s, int taps) {
  sim::SimulationConfig rig;
  rig.object = object;
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  scene.contact.threshold_n = 0.015;
  VirtualRun run(rig, scene);
  run.set_hand(tapping(speed_mm_per_s));

  Delays result;
  double height_before_mm = run.truth().tip_position_mm.z;
  double free_since_s = 0.0;
  double touched_s = -1.0;  // of the tap that waits for its detection
  bool was_declared = false;
  while (static_cast<int>(result.delay_ms.size()) + result.missed < taps &&
         run.time_s() < 3.0 * taps + 10.0) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    const double speed = (height_before_mm - truth.tip_position_mm.z) * 1000.0;
    height_before_mm = truth.tip_position_mm.z;
    const bool declared = run.record().in_contact;
    const bool declared_now = declared && !was_declared;
    was_declared = declared;
    // Only the strike out of free flight counts, not the bounces after it.
    constexpr double kFlightS = 0.1;
    if (truth.in_contact && touched_s < 0.0 && run.time_s() - free_since_s > kFlightS &&
        !(declared && !declared_now)) {
      touched_s = run.time_s() - truth.displacement_mm / std::max(1.0, speed);
      result.speed_sum_mm_per_s += speed;
    }
    if (declared_now) {
      if (touched_s >= 0.0) {
        result.delay_ms.push_back(1e3 * (run.time_s() - touched_s));
        touched_s = -1.0;
      } else if (!truth.in_contact && run.time_s() - free_since_s > kFlightS) {
        ++result.false_alarms;
      }
    }
    if (truth.in_contact) {
      free_since_s = run.time_s();
    } else if (touched_s >= 0.0 && run.time_s() - free_since_s > kFlightS) {
      ++result.missed;
      touched_s = -1.0;
    }
  }
  return result;
}

/// Ten simulated minutes of the dissertation's free motion: the scene's own alarms, and those of both methods
/// at one threshold.
void run_alarms(StudyContext& context) {
  const double duration_s = context.quick ? 30.0 : 600.0;
  sim::SimulationConfig rig;
  rig.object = "none";
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  VirtualRun run(rig, scene);
  run.set_hand(shaken());

  rt::ContactParameters parameters;
  parameters.threshold_n = 0.015;
  parameters.arming_time_ms = 5;  // a force that never rests must not keep the detector from being wrong
  rt::ContactDetector matched(parameters, rig.rate_hz);
  parameters.method = rt::ContactMethod::kFilteredAcceleration;
  rt::ContactDetector published(parameters, rig.rate_hz);
  rt::FreeMotionResidual residual(rig.tool_mass_g, rig.rate_hz);
  rt::MotionEstimator motion(run.info().device.position_resolution_mm, rig.rate_hz);
  while (run.time_s() < duration_s) {
    run.step();
    const double depth_mm = -run.sample().tip_position_mm.z;
    const double force_n = run.sample().sensor_force_n.z;
    motion.update(depth_mm, run.sample().time_ns);
    published.update(rt::reaction_force_n(force_n, rig.tool_mass_g, motion.acceleration_mm_per_s2()),
                     depth_mm, depth_mm);
    matched.update(residual.update(force_n, depth_mm, run.sample().time_ns, false), depth_mm, depth_mm);
  }

  report::Figure alarms{"contact_false_alarms"};
  alarms.value = run.record().contact_count;
  alarms.goal = 0.0;
  alarms.reference = 0.0;
  alarms.source = "D§3.2.2";
  context.report.add(alarms);
  for (const auto& [method, detector] :
       {std::pair{"matched", &matched}, std::pair{"published", &published}}) {
    report::Figure figure{"contact_false_alarms_by_method",
                          {{"method", method}, {"threshold_n", parameters.threshold_n}}};
    figure.value = detector->count();
    figure.source = "D§3.2.2";
    context.report.add(figure);
  }
}

void run_delays(StudyContext& context) {
  const std::vector<double> speeds = context.quick
                                         ? std::vector<double>{100.0, 400.0}
                                         : std::vector<double>{100, 150, 200, 300, 400, 500, 600, 800, 1000};
  const int taps = context.quick ? 2 : 12;
  report::MarkdownTable table(
      {"object", "nominal mm/s", "measured mm/s", "taps", "mean ms", "largest ms", "missed", "false alarms"});
  for (const std::string object : {"sponge_block", "foam_ball", "rubber_ball", "rubber_eraser"}) {
    for (const double speed : speeds) {
      const Delays delays = tap(object, speed, taps);
      report::Figure figure{"contact_delay_ms", {{"object", object}, {"speed_mm_per_s", speed}}};
      figure.unit = "ms";
      figure.reference = 3.0;
      figure.source = "D§3.2.2, Fig. 3.6: less than";
      if (delays.delay_ms.empty()) {
        figure.failed = "no tap was detected";
      } else {
        figure.value = delays.mean_ms();
      }
      context.report.add(figure);
      table.add_row(
          {object, report::fixed(speed, 0),
           report::fixed(delays.speed_sum_mm_per_s / static_cast<double>(delays.delay_ms.size()), 0),
           std::to_string(delays.delay_ms.size()), report::fixed(delays.mean_ms(), 2),
           report::fixed(report::quantile(delays.delay_ms, 1.0), 2), std::to_string(delays.missed),
           std::to_string(delays.false_alarms)});
    }
  }
  context.report.add_table(
      "contact_delay", "Delay of contact detection", table,
      "From the true instant of contact to the tick that declares it, sampling included.");
}

}  // namespace

void run_contact(StudyContext& context) {
  run_alarms(context);
  run_delays(context);
}

}  // namespace hapticd::study
