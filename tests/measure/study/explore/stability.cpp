#include <string>
#include <vector>

#include "rt/signal/butterworth_low_pass.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/explore/stroke_judge.h"

namespace hapticd::study {

namespace {

constexpr double kStiffest = 8.0;
constexpr double kStepRatio = 1.06;
constexpr double kQuickStepRatio = 1.25;
constexpr double kRampS = 0.3;
constexpr double kDwellS = 2.0;

/// Strokes back and forth with 3 N; friction and curvature bring the peaks to about 4 N.
sim::HandProgram endless_strokes() {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = 3.0;
  hand.speed_mm_per_s = 80.0;
  hand.stroke_length_mm = 40.0;
  hand.repetitions = -1;
  hand.approach_mm_per_s = 30.0;
  hand.force_rate_n_per_s = 4.0;
  return hand;
}
constexpr double kBeganS = 4.0;  // the hand strokes by then

struct Limit {
  double value = 0.0;  ///< 0: unstable from the start
  std::string why;
  std::vector<double> target, swing_mm;
};

/// Swing of an unrendered stroke: friction, curvature and turning do that much without any rendering.
double undisturbed_swing_mm(const sim::SimulationConfig& rig, const rt::SceneSpec& scene,
                            const rt::ObjectModel& model) {
  VirtualRun run(rig, scene, false, &model);
  run.set_hand(endless_strokes());
  while (run.time_s() < kBeganS) run.step();
  StrokeJudge judge(1000.0);
  while (run.time_s() < kBeganS + 6.0) {
    run.step();
    judge.add(run.truth().displacement_mm);
  }
  return judge.swing_mm();
}

/// Sweeps from `first` up, each target `step_ratio` times the one before.
Limit sweep_from(double first, double step_ratio, const sim::SimulationConfig& rig, rt::SceneSpec scene,
                 const rt::ObjectModel& model) {
  const double allowed_mm = StrokeJudge::kLimitCycleMm + 2.0 * undisturbed_swing_mm(rig, scene, model);
  scene.target = rt::linear_target(first);
  VirtualRun run(rig, scene, true, &model);
  run.set_hand(endless_strokes());
  while (run.time_s() < kBeganS) run.step();
  Limit limit;
  for (double target = first; target <= kStiffest; target *= step_ratio) {
    run.set_target(target, kRampS);
    const double from_s = run.time_s() + kRampS;
    StrokeJudge judge(1000.0);
    while (run.time_s() < from_s + kDwellS) {
      run.step();
      if (run.record().guard_state == rt::GuardState::kLatched) limit.why = "the guard latches";
      if (run.time_s() < from_s) continue;
      judge.add(run.truth().displacement_mm);
      if (!run.record().in_contact && run.truth().in_contact) judge.lost();
    }
    limit.target.push_back(target);
    limit.swing_mm.push_back(judge.swing_mm());
    if (judge.swing_mm() > allowed_mm) {
      limit.why = "oscillates by " + report::significant(judge.swing_mm(), 2) + " mm";
    } else if (judge.lost_share() > 0.02) {
      limit.why = "contact is lost";
    }
    if (!limit.why.empty()) return limit;
    limit.value = target;
  }
  limit.why = "end of the sweep";
  return limit;
}

/// Sweeps up and down, as D§4.6.2 did: from half the object's own stiffness, where (3.8) allows both devices
/// 3 N, and from harder targets, in case the soft end is what fails. The largest counts.
Limit sweep(const sim::SimulationConfig& rig, const rt::SceneSpec& scene, const rt::ObjectModel& model,
            bool quick) {
  const double object = sim::object_preset(rig.object)->material.stiffness_at_4n_n_per_mm;
  Limit best;
  for (const double share : {0.5, 0.8, 1.2}) {
    Limit limit = sweep_from(share * object, quick ? kQuickStepRatio : kStepRatio, rig, scene, model);
    if (limit.value > best.value || best.why.empty()) best = std::move(limit);
  }
  return best;
}

}  // namespace

void run_explore_stability(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table(
      {"device", "object", "k N/mm", "tip", "dissertation", "beyond", "default", "beyond it", "ratio"});
  report::Plot plot;
  plot.title = "Largest stable target while stroking, ball bearing";
  plot.y = {"target stiffness", "N/mm"};
  plot.y.minimum = 0.0;
  for (const std::string& object : explored_objects()) plot.x.categories.push_back(object);
  report::Plot swing;
  swing.title = "Swing against target, high-force device (dashed: dissertation)";
  swing.x = {"target stiffness", "N/mm", true};
  swing.y = {"median swing above 10 Hz", "mm", true};

  for (const std::string device : {"phantom_1_5_high_force", "phantom_1_0"}) {
    report::PlotSeries ours{device + ", default"}, theirs{device + ", dissertation"};
    for (auto* series : {&ours, &theirs}) {
      series->mark = report::PlotMark::kOfColor;
      series->color = cli::palette(device == "phantom_1_0" ? 2 : 1);
    }
    theirs.line = report::PlotLine::kDashed;
    std::size_t colour = 0;
    for (const std::string& object : explored_objects()) {
      ++colour;
      if (context.quick && object != "sponge_cut" && object != "rubber_ball_3d") continue;
      for (const bool rod : {false, true}) {
        if (context.quick && rod) continue;
        const rt::Tip tip = rod ? rt::Tip::kRod : rt::Tip::kBallBearing;
        const sim::SimulationConfig rig = explore_rig(device, object, rod ? "rod" : "ball_bearing");
        const Limit baseline =
            sweep(rig, dissertation_scene(tip), identified(object).dissertation, context.quick);
        const Limit improved = sweep(rig, explore_scene(tip), identified(object).model, context.quick);
        for (const bool is_ours : {false, true}) {
          const Limit& limit = is_ours ? improved : baseline;
          report::Figure figure{
              rod ? "stable_stiffness_max_rod" : "stable_stiffness_max",
              {{"device", device}, {"object", object}, {"pipeline", is_ours ? "default" : "dissertation"}}};
          figure.unit = "N/mm";
          figure.source = "1.5 x our own baseline; D§4.6.2";
          if (is_ours && baseline.value > 0.0) figure.goal = 1.5 * baseline.value;
          if (limit.value > 0.0) {
            figure.value = limit.value;
          } else {
            figure.failed = "unstable at 0.5, 0.8 and 1.2 times the object's own stiffness: " + limit.why;
          }
          context.report.add(figure);
        }
        const double k = sim::object_preset(object)->material.stiffness_at_4n_n_per_mm;
        table.add_row({device, object, fixed(k, 2), rod ? "rod" : "bearing",
                       baseline.value > 0.0 ? fixed(baseline.value, 2) : "none", baseline.why,
                       improved.value > 0.0 ? fixed(improved.value, 2) : "none", improved.why,
                       baseline.value > 0.0 ? fixed(improved.value / baseline.value, 1) : report::kNoNumber});
        if (rod) continue;
        const double at = static_cast<double>(&object - explored_objects().data());
        ours.add(at, improved.value);
        theirs.add(at, baseline.value);
        if (device == "phantom_1_5_high_force") {
          swing.series.push_back({object, cli::palette(colour), report::PlotLine::kSolid,
                                  cli::points_of(improved.target, improved.swing_mm)});
          swing.series.push_back({"", cli::palette(colour), report::PlotLine::kDashed,
                                  cli::points_of(baseline.target, baseline.swing_mm)});
        }
      }
    }
    plot.series.push_back(ours);
    plot.series.push_back(theirs);
  }
  context.report.add_table(
      "explore_stability", "Largest stable target stiffness while stroking, N/mm", table,
      "A hand strokes back and forth (40 mm, 80 mm/s, 3 N, peaks about 4 N). The target rises by 6 % (quick: "
      "25 "
      "%) every "
      "two seconds until the tip's displacement swings above 10 Hz by 0.5 mm more than twice what it does "
      "unrendered, contact is lost, or "
      "the guard latches.");
  context.report.add_plot("explore_stability", plot);
  context.report.add_plot("explore_swing", swing);
}

}  // namespace hapticd::study
