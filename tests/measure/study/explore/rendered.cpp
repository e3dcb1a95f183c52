#include <string>
#include <vector>

#include "rt/signal/vector.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kForceN = 4.0;

struct Press {
  double held = 0.0;      ///< force over displacement at the hand, mean of the last second of the hold
  double swing_mm = 0.0;  ///< peak to peak then
  double stroked = 0.0;   ///< mean force over mean displacement along the normal while stroking
  std::vector<double> depth_mm, force_n;  ///< while pressing and letting go
};

/// Presses with 4 N and holds; then, in a separate run, strokes.
Press press(const std::string& object, const rt::SceneSpec& scene, const rt::ObjectModel& model) {
  const sim::SimulationConfig rig = explore_rig("phantom_1_5_high_force", object, "ball_bearing");
  Press result;
  {
    VirtualRun run(rig, scene, true, &model);
    sim::HandProgram hand = pressing(kForceN);
    hand.hold_s = 4.0;
    run.set_hand(hand);
    double force = 0.0, depth = 0.0, low = 1e9, high = -1e9;
    double loaded_s = 0.0;
    while (run.time_s() < 12.0) {
      run.step();
      const hal::TruthSample& truth = run.truth();
      if (loaded_s == 0.0 && truth.in_contact)
        loaded_s = run.time_s() + 1.875 * kForceN / hand.force_rate_n_per_s;
      if (loaded_s == 0.0 || truth.displacement_mm <= 0.0) continue;
      const double since = run.time_s() - loaded_s;
      if (since > 2.5 && since < 3.5) {
        force += run.hand_force_n();
        depth += truth.displacement_mm;
        low = std::min(low, truth.displacement_mm);
        high = std::max(high, truth.displacement_mm);
      }
      if (run.sample().tick % 20 == 0) {
        result.depth_mm.push_back(truth.displacement_mm);
        result.force_n.push_back(run.hand_force_n());
      }
    }
    result.held = force / depth;
    result.swing_mm = high - low;
  }
  {
    VirtualRun run(rig, scene, true, &model);
    sim::HandProgram hand;
    hand.kind = sim::HandProgram::Kind::kStroke;
    hand.force_n = kForceN;
    hand.speed_mm_per_s = 80.0;
    hand.stroke_length_mm = 40.0;
    hand.repetitions = -1;
    hand.approach_mm_per_s = 30.0;
    hand.force_rate_n_per_s = 4.0;
    run.set_hand(hand);
    double force = 0.0, depth = 0.0;
    while (run.time_s() < 10.0) {
      run.step();
      if (run.time_s() < 4.0) continue;
      force -= dot(run.truth().hand_force_n, run.truth().outward_normal);
      depth += run.truth().displacement_mm;
    }
    result.stroked = force / depth;
  }
  return result;
}

}  // namespace

void run_explore_rendered(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table(
      {"object", "target N/mm", "pipeline", "held N/mm", "error %", "swing mm", "stroking N/mm", "error %"});
  report::Plot plot;
  plot.title = "Pressing 4 N and letting go (dashed: dissertation)";
  plot.x = {"displacement of the tip", "mm"};
  plot.y = {"force at the hand", "N"};
  plot.y.minimum = -1.0;
  plot.y.maximum = 6.0;
  int colour = 0;
  for (const std::string& object : explored_objects()) {
    for (const double target : {0.3, 0.8}) {
      const bool plotted = object == "sponge_cut" || object == "foam_ball_3d";
      if (plotted) ++colour;
      for (const bool ours : {true, false}) {
        rt::SceneSpec scene =
            ours ? explore_scene(rt::Tip::kBallBearing) : dissertation_scene(rt::Tip::kBallBearing);
        scene.target = rt::linear_target(target);
        const Press result =
            press(object, scene, ours ? identified(object).model : identified(object).dissertation);
        constexpr double kOscillationMm = 0.5;
        const bool oscillates = result.swing_mm > kOscillationMm;
        for (const bool stroking : {false, true}) {
          report::Figure figure{stroking ? "rendered_stiffness_error_stroking" : "rendered_stiffness_error",
                                {{"object", object},
                                 {"target", target},
                                 {"pipeline", ours ? "default" : "dissertation"},
                                 {"transport", "direct"}}};
          const double rendered = stroking ? result.stroked : result.held;
          if (oscillates) {
            figure.failed = "oscillates by " + report::significant(result.swing_mm, 2) + " mm while held";
          } else {
            figure.value = rendered / target - 1.0;
          }
          if (ours) figure.goal = 0.05;
          figure.reference = 0.1;
          figure.source = "D§4.7.2: PSE within about";
          context.report.add(figure);
        }
        table.add_row({object, fixed(target, 1), ours ? "default" : "dissertation", fixed(result.held, 4),
                       fixed(100.0 * (result.held / target - 1.0), 2), fixed(result.swing_mm, 3),
                       fixed(result.stroked, 4), fixed(100.0 * (result.stroked / target - 1.0), 2)});
        if (plotted && !(oscillates && !ours)) {
          plot.series.push_back({ours ? object + ", " + fixed(target, 1) + " N/mm" : std::string(),
                                 cli::palette(colour),
                                 ours ? report::PlotLine::kSolid : report::PlotLine::kDashed,
                                 cli::points_of(result.depth_mm, result.force_n)});
        }
      }
    }
  }
  context.report.add_table("explore_rendered",
                           "Rendered stiffness at the hand, high-force device, ball bearing", table,
                           "A hand presses 4 N. Held: true force over true displacement, mean of one second. "
                           "Stroking: along the true "
                           "normal, mean of six seconds back and forth at 80 mm/s.");
  context.report.add_plot("explore_rendered", plot);
}

}  // namespace hapticd::study
