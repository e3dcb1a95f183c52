#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rt/signal/vector.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"

namespace hapticd::study {

namespace {

rt::SceneSpec watcher(rt::SceneSpec scene, double threshold_n) {
  scene.contact.threshold_n = threshold_n;
  scene.contact.arming_time_ms = 5;  // a force that never rests must not keep it from being wrong
  scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  return scene;
}

/// False alarms of each threshold in free motion: the device shakes itself at 5 Hz and 1 N in several
/// directions, a hand strikes the air at 100 mm/s, and the tool sways by 20°.
std::vector<std::uint32_t> false_alarms(const std::string& device, const rt::SceneSpec& scene,
                                        const std::vector<double>& thresholds_n, double seconds) {
  std::vector<sim::HandProgram> motions;
  for (const hal::Vector3& direction : {hal::Vector3{0, 0, 1}, {1, 0, 0}, {0.6, 0.5, 0.6}}) {
    motions.push_back(shaken());
    motions.back().shake_direction = direction;
  }
  motions.push_back(tapping(100.0));
  motions.back().tap_slant_deg = 30.0;
  std::vector<std::uint32_t> alarms(thresholds_n.size(), 0);
  for (sim::HandProgram& motion : motions) {
    VirtualRun run = unrendered(explore_rig(device, "none", "ball_bearing"));
    motion.tilt_deg = 20.0;
    run.set_hand(motion);
    std::vector<Shadow> shadows;
    for (const double threshold : thresholds_n) {
      shadows.emplace_back(run.info(), watcher(scene, threshold), rt::ObjectModel{});
    }
    while (run.time_s() < seconds / static_cast<double>(motions.size())) {
      run.step();
      for (Shadow& shadow : shadows) shadow.watch(run.sample());
    }
    for (std::size_t i = 0; i < shadows.size(); ++i) alarms[i] += shadows[i].record().contact_count;
  }
  return alarms;
}

struct Delays {
  std::vector<double> ours_ms, published_ms;
  int missed = 0;
};

/// Taps an object and notes when each detector says so after the true instant, which is found between ticks
/// from depth and speed along the normal.
void tap(const std::string& object, double speed_mm_per_s, double slant_deg, int taps, double threshold_n,
         double published_threshold_n, Delays& delays) {
  VirtualRun run = unrendered(explore_rig("phantom_1_5_high_force", object, "ball_bearing"));
  sim::HandProgram hand = tapping(speed_mm_per_s, taps);
  hand.tap_slant_deg = slant_deg;
  run.set_hand(hand);
  rt::SceneSpec ours = watcher(explore_scene(rt::Tip::kBallBearing), threshold_n);
  rt::SceneSpec published = watcher(dissertation_scene(rt::Tip::kBallBearing), published_threshold_n);
  ours.contact.arming_time_ms = published.contact.arming_time_ms = 20;
  Shadow shadows[] = {Shadow(run.info(), ours, {}), Shadow(run.info(), published, {})};
  bool waits[] = {false, false};
  std::vector<double>* found[] = {&delays.ours_ms, &delays.published_ms};

  double touched_s = 0.0;
  double free_since_s = 0.0;
  hal::Vector3 last_mm;
  while (run.time_s() < 2.0 + taps / hand.rate_hz) {
    run.step();
    const hal::TruthSample& truth = run.truth();
    const double approach = -1e3 * dot(truth.tip_position_mm - last_mm, truth.outward_normal);
    last_mm = truth.tip_position_mm;
    constexpr double kFlightS = 0.1;
    if (truth.in_contact) {
      if (run.time_s() - free_since_s > kFlightS) {  // the strike, not a bounce after it
        touched_s = run.time_s() - truth.displacement_mm / std::max(1.0, approach);
        waits[0] = waits[1] = true;
      }
      free_since_s = run.time_s();
    }
    for (int i = 0; i < 2; ++i) {
      shadows[i].watch(run.sample());
      if (!waits[i]) continue;
      if (shadows[i].record().in_contact) {
        found[i]->push_back(1e3 * (run.time_s() - touched_s));
        waits[i] = false;
      } else if (!truth.in_contact && run.time_s() - touched_s > 0.1) {
        waits[i] = false;
        if (i == 0) ++delays.missed;
      }
    }
  }
}

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double v : values) sum += v;
  return values.empty() ? std::nan("") : sum / static_cast<double>(values.size());
}
double largest_of(const std::vector<double>& values) {
  return values.empty() ? std::nan("") : *std::max_element(values.begin(), values.end());
}

/// Smallest threshold without an alarm; the last one if all alarm.
double quiet_threshold(const std::vector<double>& thresholds_n, const std::vector<std::uint32_t>& alarms) {
  std::size_t i = thresholds_n.size();
  while (i > 0 && alarms[i - 1] == 0) --i;
  return thresholds_n[std::min(i, thresholds_n.size() - 1)];
}

}  // namespace

void run_explore_contact(StudyContext& context) {
  using report::fixed;
  const double seconds = context.quick ? 30.0 : 300.0;
  const std::vector<double> thresholds_n{0.006, 0.008, 0.010, 0.012, 0.014, 0.016, 0.018, 0.020, 0.022,
                                         0.025, 0.030, 0.040, 0.050, 0.060, 0.080, 0.100, 0.150};
  report::MarkdownTable alarm_table({"device", "method", "ε_f mN without alarm", "alarms at half of it"});
  double chosen_n = 0.0;
  double published_n = 0.0;
  for (const std::string device : {"phantom_1_0", "phantom_1_5_high_force"}) {
    for (const bool ours : {true, false}) {
      const rt::SceneSpec scene =
          ours ? explore_scene(rt::Tip::kBallBearing) : dissertation_scene(rt::Tip::kBallBearing);
      const std::vector<std::uint32_t> alarms = false_alarms(device, scene, thresholds_n, seconds);
      const double quiet_n = quiet_threshold(thresholds_n, alarms);
      (ours ? chosen_n : published_n) = std::max(ours ? chosen_n : published_n, quiet_n);
      std::size_t half = 0;
      while (half + 1 < thresholds_n.size() && thresholds_n[half + 1] <= 0.5 * quiet_n) ++half;
      report::Figure figure{"contact_threshold_without_alarm_n",
                            {{"device", device}, {"method", ours ? "matched" : "published"}}};
      figure.unit = "N";
      figure.value = quiet_n;
      figure.reference = 0.06;
      figure.source = "D§4.3.2";
      context.report.add(figure);
      alarm_table.add_row({device, ours ? "matched inertia" : "published (4.5)", fixed(1e3 * quiet_n, 0),
                           std::to_string(alarms[half])});
    }
  }
  context.report.add_table(
      "explore_threshold", "Threshold by the zero-false-alarm procedure", alarm_table,
      fixed(seconds, 0) +
          " s of free motion: shaken at 5 Hz and 1 N along three directions, the tool "
          "swaying by 20°. The smallest threshold of the grid above which nothing alarms.");

  const std::vector<double> speeds =
      context.quick ? std::vector<double>{200.0} : std::vector<double>{100, 200, 300, 400, 600};
  report::MarkdownTable table({"object", "taps", "mean ms", "largest ms", "missed", "published mean ms",
                               "published largest ms", "D mean ms", "D largest ms"});
  report::Plot plot;
  plot.title = "Delay of contact detection against speed (dashed: published way)";
  plot.x = {"speed towards the surface", "mm/s"};
  plot.y = {"mean delay", "ms"};
  plot.y.minimum = 0.0;
  plot.references = {{report::PlotReference::Axis::kY, 2.0, "goal"}};
  int colour = 0;
  for (const std::string& object : explored_objects()) {
    Delays total;
    report::PlotSeries ours{.name = object,
                            .color = cli::palette(static_cast<std::size_t>(++colour)),
                            .mark = report::PlotMark::kOfColor};
    report::PlotSeries published{.name = "",
                                 .color = cli::palette(static_cast<std::size_t>(colour)),
                                 .line = report::PlotLine::kDashed,
                                 .mark = report::PlotMark::kOfColor};
    for (const double speed : speeds) {
      Delays at_speed;
      for (const double slant_deg : {0.0, 30.0}) {
        tap(object, speed, slant_deg, context.quick ? 3 : 6, chosen_n, published_n, at_speed);
      }
      ours.add(speed, mean_of(at_speed.ours_ms));
      published.add(speed, mean_of(at_speed.published_ms));
      total.ours_ms.insert(total.ours_ms.end(), at_speed.ours_ms.begin(), at_speed.ours_ms.end());
      total.published_ms.insert(total.published_ms.end(), at_speed.published_ms.begin(),
                                at_speed.published_ms.end());
      total.missed += at_speed.missed;
    }
    plot.series.push_back(ours);
    plot.series.push_back(published);
    report::Figure figure{"contact_delay_mean_ms", {{"object", object}}};
    figure.unit = "ms";
    figure.value = mean_of(total.ours_ms);
    figure.goal = 2.0;
    figure.reference = 4.0;
    figure.source = "D§4.3.2: less than";
    context.report.add(figure);
    figure.figure = "contact_delay_mean_published_ms";
    figure.value = mean_of(total.published_ms);
    figure.goal.reset();
    context.report.add(figure);
    figure.figure = "contact_delay_max_ms";
    figure.value = largest_of(total.ours_ms);
    figure.reference = 7.0;
    figure.source = "D§4.3.2: largest, sponge cut";
    context.report.add(figure);
    table.add_row({object, std::to_string(total.ours_ms.size()), fixed(mean_of(total.ours_ms), 2),
                   fixed(largest_of(total.ours_ms), 2), std::to_string(total.missed),
                   fixed(mean_of(total.published_ms), 2), fixed(largest_of(total.published_ms), 2), "< 4",
                   "7"});
  }
  context.report.add_table("explore_delay", "Delay of contact detection", table,
                           "High-force device, straight and 30° slanted taps, at the threshold of each "
                           "method from the table above (" +
                               fixed(1e3 * chosen_n, 0) + " and " + fixed(1e3 * published_n, 0) + " mN).");
  context.report.add_plot("explore_delay", plot);
}

}  // namespace hapticd::study
