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

TEST(StreamCheck, NamesMetres) {
  const std::string said = complaint(with({{"tracker_unit_scale", 0.001}}));
  EXPECT_TRUE(has(said, "the poses are in metres")) << said;
  EXPECT_TRUE(has(said, "multiply positions by 1000")) << said;
}

TEST(StreamCheck, NamesInches) {
  const std::string said = complaint(with({{"tracker_unit_scale", 1.0 / 25.4}}));
  EXPECT_TRUE(has(said, "the poses are in inches")) << said;
}

TEST(StreamCheck, NamesALeftHandedFrame) {
  const std::string said = complaint(with({{"tracker_mirrored", 1.0}}));
  EXPECT_TRUE(has(said, "left-handed")) << said;
  EXPECT_TRUE(has(said, "the same left-handed frame")) << said;
  EXPECT_TRUE(
      has(complaint(with({{"tracker_mirrored", 1.0}, {"tracker_positions_only", 1.0}})), "left-handed"));
}

TEST(StreamCheck, NamesSwappedAxes) {
  const std::string said = complaint(with({{"tracker_axes_swapped", 1.0}}));
  EXPECT_TRUE(has(said, "left-handed")) << said;
  EXPECT_TRUE(has(said, "y is sent as x, x is sent as y")) << said;
}

TEST(StreamCheck, NamesAnOrderOfTheQuaternion) {
  study::RegistrationTrial trial = with({});
  for (ReferencePose& pose : trial.reference) {
    const Eigen::Quaterniond q = *pose.orientation;
    pose.orientation = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w());
  }
  EXPECT_TRUE(has(complaint(trial), "x, y, z, w")) << complaint(trial);
}

TEST(StreamCheck, NamesOrientationsThatTurnTheOtherWay) {
  study::RegistrationTrial trial = with({});
  for (ReferencePose& pose : trial.reference) pose.orientation = pose.orientation->conjugate();
  EXPECT_TRUE(has(complaint(trial), "turn the other way")) << complaint(trial);
}

TEST(StreamCheck, NamesAClockThatJumps) {
  EXPECT_TRUE(has(complaint(with({{"tracker_clock_jump_ms", 300.0}, {"tracker_clock_jump_at_s", 15.0}})),
                  "clock jumps"));
  EXPECT_TRUE(has(complaint(with({{"tracker_clock_jump_ms", -300.0}, {"tracker_clock_jump_at_s", 15.0}})),
                  "clock jumps"));
}

TEST(StreamCheck, NamesASmallJumpAfterTheFit) {
  const study::RegistrationTrial trial =
      with({{"tracker_clock_jump_ms", 15.0}, {"tracker_clock_jump_at_s", 16.0}});
  ASSERT_EQ(complaint(trial), "");
  const auto fit =
      test::value_of(fit_arm(trial.rig, trial.reference, find_nominal_arm(trial.rig.poses()).arm, {}));
  EXPECT_EQ(test::error_of(check_clock(fit)).what, "the tracker's clock jumps or drifts");
}

TEST(StreamCheck, AGoodClockIsNotComplainedOf) {
  const study::RegistrationTrial trial = with({});
  const auto fit =
      test::value_of(fit_arm(trial.rig, trial.reference, find_nominal_arm(trial.rig.poses()).arm, {}));
  EXPECT_FALSE(check_clock(fit));
}

TEST(StreamCheck, NamesAFrozenTracker) {
  const std::string said = complaint(with({{"tracker_frozen_at_s", 20.0}}));
  EXPECT_TRUE(has(said, "the tracker is frozen")) << said;
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
