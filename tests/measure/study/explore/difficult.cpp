#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "rt/guard/fault_table.h"
#include "rt/signal/vector.h"
#include "tests/measure/study/common/explore_study.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/measure/study/explore/stroke_judge.h"

namespace hapticd::study {

namespace {

struct Outcome {
  double swing_mm = 0.0;
  double angle_p95_deg = 0.0;
  double largest_command_n = 0.0;
  rt::GuardFault latched_by = rt::GuardFault::kNone;
};

Outcome stroke(const std::string& object, const rt::SceneSpec& scene, const rt::ObjectModel& model,
               double speed_mm_per_s) {
  VirtualRun run(explore_rig("phantom_1_5_high_force", object, "rod"), scene, true, &model);
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = 2.0;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.stroke_length_mm = 30.0;
  hand.repetitions = -1;
  hand.approach_mm_per_s = 30.0;
  run.set_hand(hand);
  StrokeJudge judge(1000.0);
  std::vector<double> angles_deg;
  Outcome outcome;
  while (run.time_s() < 14.0) {
    run.step();
    if (run.time_s() < 4.0) continue;
    const rt::TickRecord& record = run.record();
    judge.add(run.truth().displacement_mm);
    outcome.largest_command_n = std::max(outcome.largest_command_n, rt::norm(record.device_command_n));
    if (record.guard_state == rt::GuardState::kLatched) outcome.latched_by = record.guard_fault;
    if (!run.truth().in_contact || !record.in_contact) continue;
    const double cosine = std::clamp(dot(record.normal, run.truth().outward_normal), -1.0, 1.0);
    angles_deg.push_back(std::acos(cosine) * 180.0 / std::numbers::pi);
  }
  std::sort(angles_deg.begin(), angles_deg.end());
  if (!angles_deg.empty()) outcome.angle_p95_deg = angles_deg[angles_deg.size() * 95 / 100];
  outcome.swing_mm = judge.swing_mm();
  return outcome;
}

}  // namespace

void run_difficult(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"object", "mm/s", "target N/mm", "pipeline", "swing mm", "direction p95 °",
                               "largest command N", "guard"});
  for (const std::string object : {"sticky_gel", "foam_ridge"}) {
    // The ridge is of the ball's foam, and cannot be palpated at its edge.
    const IdentificationResult& models = identified(object == "foam_ridge" ? "foam_ball_3d" : object);
    for (const double speed : {10.0, 60.0}) {
      for (const double target : {0.3, 0.8}) {
        for (const bool ours : {true, false}) {
          rt::SceneSpec scene = ours ? explore_scene(rt::Tip::kRod) : dissertation_scene(rt::Tip::kRod);
          scene.target = rt::linear_target(target);
          const Outcome outcome = stroke(object, scene, ours ? models.model : models.dissertation, speed);
          const report::Case conditions{{"object", object},
                                        {"speed_mm_per_s", speed},
                                        {"target", target},
                                        {"pipeline", ours ? "default" : "dissertation"}};
          report::Figure swing{"difficult_swing_mm", conditions};
          swing.unit = "mm";
          swing.value = outcome.swing_mm;
          swing.source = "D§4.4.3, D§4.6.2: unstable on sticky objects and ridges";
          const bool latched = outcome.latched_by != rt::GuardFault::kNone;
          const std::string guard =
              latched ? "latched: " + std::string(rt::rule_of(outcome.latched_by).name) : "held";
          if (latched) {
            swing.value.reset();
            swing.failed = "the guard " + guard;
          }
          context.report.add(swing);
          report::Figure angle{"difficult_direction_error_p95_deg", conditions};
          angle.unit = "deg";
          angle.value = outcome.angle_p95_deg;
          context.report.add(angle);
          table.add_row({object, fixed(speed, 0), fixed(target, 1), ours ? "default" : "dissertation",
                         fixed(outcome.swing_mm, 2), fixed(outcome.angle_p95_deg, 1),
                         fixed(outcome.largest_command_n, 1), guard});
        }
      }
    }
  }
  context.report.add_table(
      "difficult", "Where the dissertation gave up: a sticky gel and a ridge of 90°, rod, high-force device",
      table,
      "Strokes of 30 mm with 2 N. The gel (μ 1.2, static 2.2 times that) sticks and jumps. Deeper than 3 mm "
      "the ridge's "
      "nearest face changes within a tick: no estimate of one normal is right there.");
}

}  // namespace hapticd::study
