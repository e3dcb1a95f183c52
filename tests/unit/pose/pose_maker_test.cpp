#include "server/pose/pose_maker.h"

#include <gtest/gtest.h>

#include <limits>

#include "hal/openhaptics/device_frame.h"
#include "server/pose/device_frame.h"
#include "tests/unit/pose/milliseconds.h"

namespace hapticd::pose {
namespace {

const PoseRequest kNow{};

hal::DeviceInfo device() {
  hal::DeviceInfo info;
  info.position_resolution_mm = 0.03;
  info.structural_stiffness_n_per_mm = 2.0;
  return info;
}

rt::TickRecord record_at(std::int64_t ms) {
  rt::TickRecord record;
  record.tick = static_cast<std::uint64_t>(ms);
  record.time_ns = ms * kMs;
  record.channels = rt::channel::kSample;
  record.tip_position_mm = {10.0, 20.0, 30.0};
  return record;
}

TEST(PoseMaker, APoseIsOfTheInstantOfTheEncoders) {
  PoseMaker maker(device());
  rt::TickRecord record = record_at(5);
  record.position_age_ns = 300'000;
  maker.follow(record, {});
  const ToolPose pose = maker.pose({0.02, PoseFrame::kRig, false}, nullptr);
  EXPECT_EQ(pose.measured_ns, 5 * kMs - 300'000);
  EXPECT_EQ(pose.time_ns, pose.measured_ns + 20 * kMs);
  EXPECT_EQ(pose.position_mm, Eigen::Vector3d(10.0, 20.0, 30.0));
  EXPECT_FALSE(pose.knows_contact);
  EXPECT_FALSE(pose.displacement_mm);
  EXPECT_FALSE(pose.orientation_sd_rad) << "nothing is known of it without a calibration";
}

TEST(PoseMaker, TakesTheBendingOutAndCountsAShareOfItAsError) {
  PoseMaker maker(device());
  rt::TickRecord record = record_at(1);
  record.channels |= rt::channel::kGuard;
  record.device_command_n = {0.0, 0.0, 4.0};  // pushes the tip up, against the hand: the tip is deeper
  SceneFacts scene;
  scene.structural_stiffness_n_per_mm = 2.0;
  maker.follow(record, scene);
  const ToolPose pose = maker.pose(kNow, nullptr);
  EXPECT_NEAR(pose.position_mm.z(), 28.0, 1e-12);
  EXPECT_NEAR(pose.bending_mm.z(), -2.0, 1e-12);
  EXPECT_NEAR(pose.covariance_mm2(2, 2), 0.25 + 0.03 * 0.03 / 12.0, 1e-9);
  EXPECT_NEAR(pose.covariance_mm2(0, 0), 0.03 * 0.03 / 12.0, 1e-12);
  EXPECT_EQ(pose.error_sources, error_source::kResolution | error_source::kBending);
  const ToolPose raw = maker.pose({0.0, PoseFrame::kRig, true}, nullptr);
  EXPECT_NEAR(raw.position_mm.z(), 30.0, 1e-12);
  EXPECT_EQ(raw.bending_mm.norm(), 0.0);
}

TEST(PoseMaker, ThePressAxisGivesTheNormalInOneDimensionAndTheRecordInThree) {
  PoseMaker maker(device());
  SceneFacts scene{.press_axis = hal::Vector3{0.0, 0.0, -1.0}};
  rt::TickRecord record = record_at(1);
  record.channels |= rt::channel::kContact;
  maker.follow(record, scene);
  EXPECT_FALSE(maker.pose(kNow, nullptr).normal) << "not in contact";
  record.in_contact = true;
  maker.follow(record, scene);
  EXPECT_EQ(*maker.pose(kNow, nullptr).normal, Eigen::Vector3d(0.0, 0.0, 1.0));
  record.channels |= rt::channel::kDirection;
  record.normal = {0.6, 0.0, 0.8};
  maker.follow(record, {});
  EXPECT_NEAR((*maker.pose(kNow, nullptr).normal - Eigen::Vector3d(0.6, 0.0, 0.8)).norm(), 0.0, 1e-12);
  record.normal = {};
  maker.follow(record, {});
  EXPECT_FALSE(maker.pose(kNow, nullptr).normal) << "a direction of length zero is none";
}

TEST(PoseMaker, TheDeviceFrameIsThatOfTheVendor) {
  const hal::Vector3 origin{1.0, 2.0, 3.0};
  const DeviceFrame frame = openhaptics_frame(origin);
  PoseMaker maker(device(), frame);
  maker.follow(record_at(1), {});
  const ToolPose pose = maker.pose({0.0, PoseFrame::kDevice, false}, nullptr);
  const hal::Vector3 expected = openhaptics::device_from_rig({10.0, 20.0, 30.0}) + origin;
  EXPECT_NEAR(pose.position_mm.x(), expected.x, 1e-12);
  EXPECT_NEAR(pose.position_mm.y(), expected.y, 1e-12);
  EXPECT_NEAR(pose.position_mm.z(), expected.z, 1e-12);
}

calibration::ArmCalibration registration() {
  calibration::ArmCalibration calibration;
  calibration.name = "abc";
  calibration.registered = true;
  calibration.reference_from_rig.rotation =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.5 * 3.14159265358979323846, Eigen::Vector3d::UnitZ()));
  calibration.reference_from_rig.translation_mm = {100.0, 0.0, 0.0};
  calibration.misfit_mm2 = Eigen::Vector3d(0.01, 0.04, 0.09).asDiagonal();
  return calibration;
}

TEST(PoseMaker, InTheReferenceFrameAllOfThePoseIsTurned) {
  PoseMaker maker(device());
  SceneFacts scene{.press_axis = hal::Vector3{-1.0, 0.0, 0.0}};
  for (int ms = 0; ms < 50; ++ms) {
    rt::TickRecord record = record_at(ms);
    record.tip_position_mm.x += 0.1 * ms;
    record.channels |= rt::channel::kContact | rt::channel::kInclusion;
    record.inclusion_position_mm = {1.0, 0.0, 0.0};
    record.in_contact = ms > 10;
    record.contact_count = ms > 10 ? 1 : 0;
    record.contact_onset = {8 * kMs, 7 * kMs, 9 * kMs};
    maker.follow(record, scene);
  }
  const calibration::ArmCalibration calibration = registration();
  const ToolPose rig = maker.pose(kNow, &calibration);
  const ToolPose pose = maker.pose({0.0, PoseFrame::kReference, false}, &calibration);
  EXPECT_NEAR(pose.position_mm.x(), 100.0 - rig.position_mm.y(), 1e-9);
  EXPECT_NEAR(pose.position_mm.y(), rig.position_mm.x(), 1e-9);
  EXPECT_NEAR(pose.velocity_mm_per_s.y(), 100.0, 1e-6);
  EXPECT_NEAR(pose.normal->y(), 1.0, 1e-9);
  EXPECT_NEAR(pose.inclusion_mm->y(), 1.0, 1e-9);
  EXPECT_NEAR(pose.inclusion_mm->x(), 100.0, 1e-9);
  EXPECT_NEAR(pose.contact->tip_mm.y(), 10.8, 1e-9);
  EXPECT_EQ(pose.calibration, "abc");
  EXPECT_NE(pose.error_sources & error_source::kCalibration, 0U);
  EXPECT_TRUE(pose.orientation_sd_rad);
  // The misfit is stated in the rig's axes, and turns with them.
  EXPECT_NEAR(rig.covariance_mm2(0, 0), 0.01 + 0.03 * 0.03 / 12.0, 1e-6);
  EXPECT_NEAR(pose.covariance_mm2(1, 1), rig.covariance_mm2(0, 0), 1e-6);
}

TEST(PoseMaker, UncorrectedAndDevicePosesKnowNoCalibration) {
  PoseMaker maker(device());
  maker.follow(record_at(1), {});
  const calibration::ArmCalibration calibration = registration();
  for (const PoseRequest request :
       {PoseRequest{0.0, PoseFrame::kRig, true}, PoseRequest{0.0, PoseFrame::kDevice, false}}) {
    const ToolPose pose = maker.pose(request, &calibration);
    EXPECT_EQ(pose.calibration, "");
    EXPECT_EQ(pose.error_sources & error_source::kCalibration, 0U);
  }
}

TEST(PoseMaker, ARecordThatIsNoNumberLeavesTheMotionAsItWas) {
  PoseMaker maker(device());
  maker.follow(record_at(1), {});
  rt::TickRecord broken = record_at(2);
  broken.tip_position_mm.x = std::numeric_limits<double>::quiet_NaN();
  broken.tip_orientation = {0.0, 0.0, 0.0, 0.0};
  maker.follow(broken, {});
  const ToolPose pose = maker.pose({0.05, PoseFrame::kRig, false}, nullptr);
  EXPECT_TRUE(pose.position_mm.allFinite());
  EXPECT_TRUE(pose.covariance_mm2.allFinite());
  EXPECT_NEAR(pose.orientation.norm(), 1.0, 1e-12);
}

}  // namespace
}  // namespace hapticd::pose
