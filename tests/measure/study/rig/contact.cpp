#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rt/contact/contact_detector.h"
#include "rt/contact/free_motion_residual.h"
#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_compensation.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/rig_study.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

/// A detector that only watches a run, next to the scene's own.
struct Watcher {
  double threshold_n;
  rt::ContactMethod method;
  rt::ContactDetector detector;
};

struct Delays {
  std::vector<double> delay_ms;
  double speed_sum_mm_per_s = 0.0;
  int missed = 0;
  int false_alarms = 0;

  double mean_ms() const {
    double sum = 0.0;
    for (const double d : delay_ms) sum += d;
    return delay_ms.empty() ? 0.0 : sum / static_cast<double>(delay_ms.size());
  }
  double max_ms() const {
    return delay_ms.empty() ? 0.0 : *std::max_element(delay_ms.begin(), delay_ms.end());
  }
  double speed_mm_per_s() const {
    return delay_ms.empty() ? 0.0 : speed_sum_mm_per_s / static_cast<double>(delay_ms.size());
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

/// Ten simulated minutes of the dissertation's free motion, for every threshold and both methods in one run.
void run_thresholds(StudyContext& context) {
  const double duration_s = context.quick ? 30.0 : 600.0;
  sim::SimulationConfig rig;
  rig.object = "none";
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  VirtualRun run(rig, scene);
  run.set_hand(shaken());

  const std::vector<double> thresholds_n{0.005, 0.0075, 0.010, 0.0125, 0.015, 0.020, 0.030, 0.045, 0.060};
  std::vector<Watcher> watchers;
  for (const rt::ContactMethod method :
       {rt::ContactMethod::kMatchedInertia, rt::ContactMethod::kFilteredAcceleration}) {
    for (const double threshold : thresholds_n) {
      rt::ContactParameters parameters;
      parameters.method = method;
      parameters.threshold_n = threshold;
      parameters.arming_time_ms = 5;  // a force that never rests must not keep the detector from being wrong
      watchers.push_back({threshold, method, rt::ContactDetector(parameters, rig.rate_hz)});
    }
  }
  rt::FreeMotionResidual residual(rig.tool_mass_g, rig.rate_hz);
  rt::MotionEstimator motion(run.info().device.position_resolution_mm, rig.rate_hz);
  double largest_matched_n = 0.0;
  double largest_published_n = 0.0;
  std::uint32_t scene_alarms = 0;
  while (run.time_s() < duration_s) {
    run.step();
    const double depth_mm = -run.sample().tip_position_mm.z;
    const double force_n = run.sample().sensor_force_n.z;
    motion.update(depth_mm, run.sample().time_ns);
    const double published_n =
        rt::reaction_force_n(force_n, rig.tool_mass_g, motion.acceleration_mm_per_s2());
    const double matched_n = residual.update(force_n, depth_mm, run.sample().time_ns, false);
    if (run.time_s() > 0.1) {
      largest_matched_n = std::max(largest_matched_n, std::abs(matched_n));
      largest_published_n = std::max(largest_published_n, std::abs(published_n));
    }
    for (Watcher& watcher : watchers) {
      watcher.detector.update(watcher.method == rt::ContactMethod::kMatchedInertia ? matched_n : published_n,
                              depth_mm, depth_mm);
    }
    scene_alarms = run.record().contact_count;
  }

  report::Figure alarms{"contact_false_alarms"};
  alarms.value = scene_alarms;
  alarms.goal = 0.0;
  alarms.reference = 0.0;
  alarms.source = "D§3.2.2";
  context.report.add(alarms);

  report::MarkdownTable table({"ε_f mN", "alarms, matched", "alarms, published"});
  for (std::size_t i = 0; i < thresholds_n.size(); ++i) {
    table.add_row({report::fixed(1e3 * thresholds_n[i], 1), std::to_string(watchers[i].detector.count()),
                   std::to_string(watchers[thresholds_n.size() + i].detector.count())});
  }
  for (const auto& [method, watcher_index] :
       {std::pair{"matched", std::size_t{4}}, std::pair{"published", std::size_t{13}}}) {
    report::Figure figure{"contact_false_alarms_by_method", {{"method", method}, {"threshold_n", 0.015}}};
    figure.value = watchers[watcher_index].detector.count();
    figure.source = "D§3.2.2";
    context.report.add(figure);
  }
  context.report.add_table("contact_threshold", "Contact threshold: false alarms", table,
                           report::fixed(duration_s, 0) +
                               " s of free motion on the PHANToM 1.0. Largest force left of free motion: " +
                               report::fixed(1e3 * largest_matched_n, 1) + " mN matched, " +
                               report::fixed(1e3 * largest_published_n, 1) + " mN as published.");
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
      table.add_row({object, report::fixed(speed, 0), report::fixed(delays.speed_mm_per_s(), 0),
                     std::to_string(delays.delay_ms.size()), report::fixed(delays.mean_ms(), 2),
                     report::fixed(delays.max_ms(), 2), std::to_string(delays.missed),
                     std::to_string(delays.false_alarms)});
    }
  }
  context.report.add_table(
      "contact_delay", "Delay of contact detection", table,
      "From the true instant of contact to the tick that declares it, sampling included.");
}

}  // namespace

void run_contact(StudyContext& context) {
  run_thresholds(context);
  run_delays(context);
}

}  // namespace hapticd::study
