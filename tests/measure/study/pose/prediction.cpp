#include <cmath>
#include <deque>
#include <string>
#include <vector>

#include "server/pose/pose_maker.h"
#include "server/telemetry/angular_velocity.h"
#include "tests/measure/report/quantile.h"
#include "tests/measure/study/common/hands.h"
#include "tests/measure/study/common/parts.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"

namespace hapticd::study {

namespace {

constexpr double kSettleS = 1.5;

/// A motion of the hand, and the scene it is made in.
struct Motion {
  std::string name;
  sim::SimulationConfig rig;
  rt::SceneSpec scene;
  sim::HandProgram hand;
  double seconds = 20.0;
  bool judged_in_contact_only = false;
};

std::vector<Motion> motions(bool quick) {
  std::vector<Motion> all;
  for (const double rate_hz : {0.5, 1.0, 1.5}) {
    Motion sway;
    sway.name = "sway at " + report::fixed(rate_hz, 1) + " Hz";
    sway.rig.object = "none";
    sway.scene.name = "tap_1d";
    sway.hand.kind = sim::HandProgram::Kind::kSway;
    sway.hand.speed_mm_per_s = 200.0;
    sway.hand.rate_hz = rate_hz;
    sway.hand.hold_s = -1.0;
    sway.hand.tilt_deg = 15.0;
    sway.seconds = quick ? 6.0 : 30.0;
    all.push_back(sway);
  }
  Motion tap;
  tap.name = "tap at 200 mm/s";
  tap.rig.object = "foam_ball";
  tap.scene.name = "tap_1d";
  tap.hand = tapping(200.0);
  tap.seconds = quick ? 6.0 : 30.0;
  all.push_back(tap);
  Motion stroke;
  stroke.name = "stroke at 200 mm/s, in contact";
  stroke.rig = explore_rig("phantom_1_5_high_force", "foam_ball_3d", "ball_bearing");
  stroke.scene = explore_scene(rt::Tip::kBallBearing);
  stroke.scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  stroke.hand = judged_strokes(2.0, 200.0);
  stroke.hand.repetitions = quick ? 2 : 10;
  stroke.seconds = quick ? 6.0 : 14.0;
  stroke.judged_in_contact_only = true;
  all.push_back(stroke);
  return all;
}

/// What the errors of one motion are.
struct Judged {
  double predicted_sum = 0.0;  ///< of squares, mm²
  double unpredicted_sum = 0.0;
  double expected_sum = 0.0;  ///< of the squared errors that were stated
  std::size_t count = 0;
  std::size_t beyond_bound = 0;
  std::vector<double> share;  ///< error over what was stated
};

struct Waiting {
  std::int64_t due_ns = 0;
  pose::ToolPose predicted;
  Eigen::Vector3d now_mm = Eigen::Vector3d::Zero();
};

Judged judge(const Motion& motion, double ahead_s) {
  VirtualRun run(motion.rig, motion.scene);
  run.set_hand(motion.hand);
  pose::PoseMaker maker(run.info().device);
  server::AngularVelocity turning;
  pose::SceneFacts facts;
  facts.press_axis = run.scene().press_axis;
  facts.structural_stiffness_n_per_mm = run.info().device.structural_stiffness_n_per_mm;
  const pose::PoseRequest ahead{ahead_s, pose::PoseFrame::kRig, false};
  const pose::PoseRequest now{0.0, pose::PoseFrame::kRig, false};
  std::deque<Waiting> waiting;
  Judged judged;
  while (run.time_s() < motion.seconds) {
    run.step();
    rt::TickRecord record = run.record();
    record.angular_velocity_rad_per_s = turning.follow(record.tip_orientation, record.time_ns);
    maker.follow(record, facts);
    const hal::Vector3& p = run.truth().tip_position_mm;
    const Eigen::Vector3d truth_mm(p.x, p.y, p.z);
    while (!waiting.empty() && waiting.front().due_ns <= record.time_ns) {
      const Waiting& due = waiting.front();
      const double error = (due.predicted.position_mm - truth_mm).norm();
      const double stated = std::sqrt(due.predicted.covariance_mm2.trace());
      judged.predicted_sum += error * error;
      judged.unpredicted_sum += (due.now_mm - truth_mm).squaredNorm();
      judged.expected_sum += stated * stated;
      if (error > due.predicted.prediction.error_bound_mm) ++judged.beyond_bound;
      judged.share.push_back(error / stated);
      ++judged.count;
      waiting.pop_front();
    }
    const bool counts = run.time_s() > kSettleS && (!motion.judged_in_contact_only || record.in_contact);
    if (!counts || record.tick % 8 != 0) continue;
    const pose::ToolPose predicted = maker.pose(ahead, nullptr);
    waiting.push_back({predicted.time_ns, predicted, maker.pose(now, nullptr).position_mm});
  }
  return judged;
}

}  // namespace

void run_pose_prediction(StudyContext& context) {
  using report::fixed;
  report::MarkdownTable table({"motion", "ahead ms", "not predicted mm", "predicted mm", "gain", "stated mm",
                               "stated / seen", "beyond 2 stated %", "beyond bound %"});
  for (const Motion& motion : motions(context.quick)) {
    for (const double ahead_ms : {20.0, 66.0, 100.0}) {
      const Judged judged = judge(motion, 1e-3 * ahead_ms);
      const report::Case conditions{{"motion", motion.name}, {"ahead_ms", ahead_ms}};
      report::Figure gain{"prediction_gain", conditions};
      report::Figure stated{"prediction_stated_over_seen", conditions};
      if (ahead_ms == 66.0) gain.goal = 0.5;
      if (judged.count == 0) {
        gain.failed = stated.failed = "nothing was predicted";
        context.report.add(gain);
        context.report.add(stated);
        continue;
      }
      const auto n = static_cast<double>(judged.count);
      const double predicted = std::sqrt(judged.predicted_sum / n);
      const double unpredicted = std::sqrt(judged.unpredicted_sum / n);
      const double expected = std::sqrt(judged.expected_sum / n);
      gain.value = predicted / unpredicted;
      stated.value = expected / predicted;
      context.report.add(gain);
      context.report.add(stated);
      double beyond = 0.0;
      for (const double share : judged.share) beyond += share > 2.0 ? 1.0 : 0.0;
      table.add_row({motion.name, fixed(ahead_ms, 0), fixed(unpredicted, 2), fixed(predicted, 2),
                     fixed(predicted / unpredicted, 2), fixed(expected, 2), fixed(expected / predicted, 2),
                     fixed(100.0 * beyond / n, 1),
                     fixed(100.0 * static_cast<double>(judged.beyond_bound) / n, 2)});
    }
  }
  context.report.add_table("pose_prediction", "Poses predicted ahead", table,
                           "Root mean square against the true tip, the device's bending taken out.");
}

}  // namespace hapticd::study
