#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "rt/signal/vector.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/shadow.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/pose/pose_study.h"
#include "tests/measure/report/quantile.h"

namespace hapticd::study {

namespace {

constexpr double kFlightS = 0.1;  // only the strike out of free flight counts, not the bounces after it
constexpr double kGoalMs = 1.0;

struct TapRun {
  VirtualRun run;
  Shadow shadow;
};

TapRun begin(const std::string& object, bool three_dimensions) {
  sim::SimulationConfig rig;
  rig.object = object;
  rt::SceneSpec scene;
  scene.name = "tap_1d";
  if (three_dimensions) {
    rig = explore_rig("phantom_1_5_high_force", object, "ball_bearing");
    scene = explore_scene(rt::Tip::kBallBearing);
    scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  }
  VirtualRun run = unrendered(rig);
  Shadow shadow(run.info(), scene, {});
  return {std::move(run), std::move(shadow)};
}

}  // namespace

OnsetErrors tap_for_onsets(const std::string& object, bool three_dimensions, double speed_mm_per_s,
                           int taps) {
  TapRun tap = begin(object, three_dimensions);
  tap.run.set_hand(tapping(speed_mm_per_s));
  OnsetErrors found;
  hal::Vector3 before_mm = tap.run.truth().tip_position_mm;
  double before_s = 0.0;
  double depression_mm = 0.0;
  double free_since_s = 0.0;
  double touched_s = -1.0;
  std::uint32_t count = 0;
  while (static_cast<int>(found.error_ms.size()) + found.missed < taps &&
         tap.run.time_s() < 3.0 * taps + 10.0) {
    tap.run.step();
    tap.shadow.watch(tap.run.sample());
    const hal::TruthSample& truth = tap.run.truth();
    const double now_s = tap.run.time_s();
    const double approach =
        -dot(truth.tip_position_mm - before_mm, truth.outward_normal) / std::max(1e-6, now_s - before_s);
    if (truth.in_contact && touched_s < 0.0 && now_s - free_since_s > kFlightS) {
      // The surface may still be on its way back from the tap before.
      const double inside_mm = truth.displacement_mm - depression_mm;
      touched_s = now_s - std::clamp(inside_mm / std::max(1.0, approach), 0.0, now_s - before_s);
    }
    if (truth.in_contact) free_since_s = now_s;
    before_mm = truth.tip_position_mm;
    before_s = now_s;
    depression_mm = truth.surface_depression_mm;
    const rt::TickRecord& record = tap.shadow.record();
    if (record.contact_count != count) {
      count = record.contact_count;
      if (touched_s >= 0.0) {
        const double truth_ns = 1e9 * touched_s;
        const rt::OnsetInstant& onset = record.contact_onset;
        found.error_ms.push_back(1e-6 * (static_cast<double>(onset.time_ns) - truth_ns));
        found.noticed_ms.push_back(1e3 * (now_s - touched_s));
        const bool inside = truth_ns >= static_cast<double>(onset.earliest_ns) - 1.0 &&
                            truth_ns <= static_cast<double>(onset.latest_ns) + 1.0;
        if (!inside) ++found.outside_bounds;
        touched_s = -2.0;
      }
    }
    if (!truth.in_contact && now_s - free_since_s > kFlightS) {
      if (touched_s >= 0.0) ++found.missed;
      touched_s = -1.0;
    }
  }
  return found;
}

void run_contact_onset(StudyContext& context) {
  using report::fixed;
  using report::quantile;
  const int taps = context.quick ? 8 : 60;
  report::MarkdownTable table({"dimensions", "object", "speed mm/s", "median error ms", "95 % of |error| ms",
                               "noticed after ms", "true instant outside its bounds", "missed"});
  for (const bool three : {false, true}) {
    const std::vector<std::string> objects =
        three ? explored_objects() : std::vector<std::string>{"sponge_block", "foam_ball", "rubber_ball"};
    for (const std::string& object : objects) {
      for (const double speed : {20.0, 50.0, 100.0, 200.0, 400.0}) {
        const OnsetErrors found = tap_for_onsets(object, three, speed, taps);
        std::vector<double> size;
        for (const double e : found.error_ms) size.push_back(std::abs(e));
        report::Figure figure{"contact_onset_error_ms",
                              {{"dimensions", three ? 3 : 1}, {"object", object}, {"speed_mm_per_s", speed}}};
        figure.unit = "ms";
        figure.goal = kGoalMs;
        if (size.empty()) {
          figure.failed = "no contact was declared";
        } else {
          figure.value = quantile(size, 0.95);
        }
        context.report.add(figure);
        table.add_row({three ? "3" : "1", object, fixed(speed, 0), fixed(quantile(found.error_ms, 0.5), 2),
                       fixed(quantile(size, 0.95), 2), fixed(quantile(found.noticed_ms, 0.5), 1),
                       std::to_string(found.outside_bounds), std::to_string(found.missed)});
      }
    }
  }
  context.report.add_table("contact_onset", "When a contact began", table,
                           "Taps out of free flight; positive errors: reported late.");
}

}  // namespace hapticd::study
