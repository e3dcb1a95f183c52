#include "server/calibration/estimate/stream_check.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "server/calibration/estimate/clock_check.h"
#include "server/calibration/estimate/nominal_arm.h"
#include "server/calibration/estimate/stream_offset.h"
#include "tests/support/calibration/registration_trial.h"
#include "tests/support/value_of.h"

namespace hapticd::calibration {
namespace {

study::RegistrationTrial with(std::map<std::string, double> conditions) {
  return study::record_trial(
      {.seed = 5, .calibration_s = 30.0, .held_out_s = 1.0, .conditions = std::move(conditions)});
}

std::string complaint(const study::RegistrationTrial& trial) {
  const auto error = check_stream(trial.rig, trial.reference, {});
  return error ? error->what + " | " + error->value + " | " + error->remedy : "";
}

bool has(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

TEST(StreamCheck, LetsAGoodStreamPass) {
  EXPECT_EQ(complaint(with({})), "");
  EXPECT_EQ(complaint(with({{"tracker_positions_only", 1.0}})), "");
}

TEST(StreamCheck, NamesWhatTheTrackerDoesWrong) {
  struct Case {
    std::map<std::string, double> conditions;
    const char* words;
    const char* more = "";
  };
  for (const Case& c :
       {Case{{{"tracker_unit_scale", 0.001}}, "the poses are in metres", "multiply positions by 1000"},
        Case{{{"tracker_unit_scale", 1.0 / 25.4}}, "the poses are in inches"},
        Case{{{"tracker_mirrored", 1.0}}, "left-handed", "the same left-handed frame"},
        Case{{{"tracker_mirrored", 1.0}, {"tracker_positions_only", 1.0}}, "left-handed"},
        Case{{{"tracker_axes_swapped", 1.0}}, "left-handed", "y is sent as x, x is sent as y"},
        Case{{{"tracker_clock_jump_ms", 300.0}, {"tracker_clock_jump_at_s", 15.0}}, "clock jumps"},
        Case{{{"tracker_clock_jump_ms", -300.0}, {"tracker_clock_jump_at_s", 15.0}}, "clock jumps"},
        Case{{{"tracker_frozen_at_s", 20.0}}, "the tracker is frozen"}}) {
    const std::string said = complaint(with(c.conditions));
    EXPECT_TRUE(has(said, c.words)) << c.words << ": " << said;
    EXPECT_TRUE(has(said, c.more)) << c.more << ": " << said;
  }
}

TEST(StreamCheck, NamesAnOrderOfTheQuaternionAndATurnTheOtherWay) {
  const study::RegistrationTrial good = with({});
  study::RegistrationTrial reordered = good, other_way = good;
  for (std::size_t i = 0; i < good.reference.size(); ++i) {
    const Eigen::Quaterniond q = *good.reference[i].orientation;
    reordered.reference[i].orientation = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
    other_way.reference[i].orientation = q.conjugate();
  }
  EXPECT_TRUE(has(complaint(reordered), "x, y, z, w")) << complaint(reordered);
  EXPECT_TRUE(has(complaint(other_way), "turn the other way")) << complaint(other_way);
}

TEST(StreamCheck, NamesASmallJumpAfterTheFitAndComplainsOfNoGoodClock) {
  for (const double jump_ms : {0.0, 15.0}) {
    const study::RegistrationTrial trial =
        with({{"tracker_clock_jump_ms", jump_ms}, {"tracker_clock_jump_at_s", 16.0}});
    ASSERT_EQ(complaint(trial), "");
    const auto fit =
        test::value_of(fit_arm(trial.rig, trial.reference, find_nominal_arm(trial.rig.poses()).arm, {}));
    const auto error = check_clock(fit);
    EXPECT_EQ(error ? error->what : "", jump_ms > 0.0 ? "the tracker's clock jumps or drifts" : "");
  }
}

TEST(StreamCheck, NamesTooFewPoses) {
  study::RegistrationTrial trial = with({});
  trial.reference.resize(30);
  EXPECT_TRUE(has(complaint(trial), "too few poses"));
}

TEST(StreamCheck, NamesAMarkerThatIsNotOnTheTool) {
  study::RegistrationTrial trial = with({});
  const study::RegistrationTrial other =
      study::record_trial({.seed = 6, .calibration_s = 30.0, .held_out_s = 1.0});
  // Another tool's motion, an hour of it away.
  trial.reference = other.reference;
  for (ReferencePose& pose : trial.reference)
    pose.position_mm = Eigen::Vector3d(std::sin(9.0 * pose.stamp_s), 1.0, 2.0);
  EXPECT_TRUE(has(complaint(trial), "does not see the device move")) << complaint(trial);
}

TEST(StreamCheck, RefusesAMotionInAPlane) {
  study::RegistrationTrial trial = with({});
  RigStream flat;
  for (RigPose pose : trial.rig.poses()) {
    pose.tip_mm.z() *= 0.01;
    flat.add(pose);
  }
  trial.rig = flat;
  EXPECT_TRUE(has(complaint(trial), "too flat")) << complaint(trial);
}

TEST(StreamOffset, IsFoundForAnyClockOfTheTracker) {
  study::RegistrationTrial trial = with({});
  const auto near = test::value_of(find_offset(trial.rig, trial.reference, -0.1, 0.5));
  for (const double ahead_s : {-40.0, 5.0, 1.76e9}) {
    std::vector<ReferencePose> shifted = trial.reference;
    for (ReferencePose& pose : shifted) pose.stamp_s += ahead_s;
    const auto found = test::value_of(find_any_offset(trial.rig, shifted));
    EXPECT_NEAR(found.offset_s, ahead_s + near.offset_s, 0.02);
  }
}

TEST(StreamOffset, IsNotSearchedForInARecordingOfYears) {
  RigStream years;
  std::vector<ReferencePose> reference;
  for (int i = 0; i < 200; ++i) {
    RigPose pose;
    pose.time_s = 1e6 * i;
    years.add(pose);
    reference.push_back({.stamp_s = 1e6 * i});
  }
  EXPECT_FALSE(find_any_offset(years, reference));
}

}  // namespace
}  // namespace hapticd::calibration
