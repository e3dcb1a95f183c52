#include "server/calibration/estimate/arm_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/calibration/estimate/coverage.h"
#include "server/calibration/estimate/nominal_arm.h"
#include "tests/support/calibration/registration_trial.h"
#include "tests/support/value_of.h"

namespace hapticd::calibration {
namespace {

/// An arm, once for all tests: recording it takes a second.
const study::RegistrationTrial& trial() {
  static const study::RegistrationTrial recorded =
      study::record_trial({.seed = 11, .calibration_s = 40.0, .held_out_s = 15.0});
  return recorded;
}

const NominalArm& nominal() {
  static const NominalArm found = find_nominal_arm(trial().rig.poses());
  return found;
}

TEST(NominalArm, IsFoundFromWhatTheDeviceReports) {
  EXPECT_EQ(nominal().arm.use, rt::AngleUse::kPose);
  EXPECT_NEAR(nominal().arm.first_link_mm, 215.0, 0.01);
  EXPECT_NEAR(nominal().arm.second_link_mm, 170.0, 0.01);
  EXPECT_LT(nominal().position_rms_mm, 0.01);
  for (std::size_t i = 0; i < trial().rig.size(); i += 500) {
    const RigPose& pose = trial().rig.poses()[i];
    EXPECT_LT((wrist_mm(nominal().arm, pose.angles) - pose.tip_mm).norm(), 0.01);
    EXPECT_LT(rt::turn_of(tool_orientation(nominal().arm, pose.angles).conjugate() * pose.orientation).norm(),
              1e-3);
  }
}

TEST(NominalArm, OtherSignsAndZerosOfTheAnglesAreFound) {
  std::vector<RigPose> poses = trial().rig.poses();
  for (RigPose& pose : poses) {
    pose.angles.joint_rad[0] = -pose.angles.joint_rad[0];
    pose.angles.joint_rad[1] = 0.3 - pose.angles.joint_rad[1];
    pose.angles.gimbal_rad[2] = -pose.angles.gimbal_rad[2];
  }
  const NominalArm found = find_nominal_arm(poses);
  EXPECT_EQ(found.arm.use, rt::AngleUse::kPose);
  EXPECT_NEAR(found.arm.first_link_mm, 215.0, 0.1);
  EXPECT_NEAR(found.arm.second_link_mm, 170.0, 0.1);
}

TEST(NominalArm, AnglesThatDescribeNoArmAreNotUsed) {
  std::vector<RigPose> poses = trial().rig.poses();
  for (RigPose& pose : poses) pose.angles.joint_rad[1] *= std::cos(3.0 * pose.angles.joint_rad[0]);
  EXPECT_EQ(find_nominal_arm(poses).arm.use, rt::AngleUse::kNone);
}

TEST(ArmFit, EndsSoonOnceItIsGivenUp) {
  int asked = 0;
  ArmFitSettings settings;
  settings.given_up = [&asked] { return ++asked > 3; };
  const auto fit = fit_arm(trial().rig, trial().reference, nominal().arm, settings);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().what, "the fit was given up");
  EXPECT_LT(asked, 10) << "no more than once in each of its loops";
}

TEST(ArmFit, FitsEvenlySpacedOnesOfManyPoses) {
  ArmFitSettings settings{.max_poses = trial().reference.size() / 2};
  const auto fit = test::value_of(fit_arm(trial().rig, trial().reference, nominal().arm, settings));
  EXPECT_LE(fit.poses, settings.max_poses);
  EXPECT_GT(fit.poses, settings.max_poses / 2);
  EXPECT_NEAR(fit.latency_s, trial().latency_s, 1e-3);
}

TEST(ArmFit, FindsTheTipOnMotionItDidNotSee) {
  const auto fit = test::value_of(fit_arm(trial().rig, trial().reference, nominal().arm, {}));
  const study::TargetErrors errors = study::judge(trial(), fit);
  EXPECT_LT(errors.median_mm, 0.5);
  EXPECT_LT(errors.quantile_95_mm, 1.0);
  EXPECT_LT(errors.orientation_95_rad, 0.5 / 57.3);
  EXPECT_NEAR(fit.latency_s, trial().latency_s, 5e-4);
  // Half and twice: one arm's errors are one draw.
  EXPECT_GT(errors.predicted_rms_mm, 0.5 * errors.rms_mm);
  EXPECT_LT(errors.predicted_rms_mm, 2.0 * errors.rms_mm);
  EXPECT_GT(fit.outliers, 0U);
  EXPECT_LT(fit.outliers, fit.poses / 20);
}

TEST(ArmFit, IsBetterThanRigidAloneAndThanWithoutLatency) {
  const auto error = [&](FitMethod method) {
    const auto fit = fit_arm(trial().rig, trial().reference, nominal().arm, {.method = method});
    return fit ? study::judge(trial(), *fit).quantile_95_mm : HUGE_VAL;
  };
  const double all = error(FitMethod::kArm);
  EXPECT_LT(all, 0.5 * error(FitMethod::kRigidLatency));
  EXPECT_LT(all, 0.5 * error(FitMethod::kArmNoLatency));
  EXPECT_LT(all, 0.5 * error(FitMethod::kRigid));
}

TEST(ArmFit, WorksWithPositionsAlone) {
  std::vector<ReferencePose> reference = trial().reference;
  for (ReferencePose& pose : reference) pose.orientation.reset();
  const auto fit = test::value_of(fit_arm(trial().rig, reference, nominal().arm, {}));
  EXPECT_FALSE(fit.has_orientation);
  EXPECT_LT(study::judge(trial(), fit).quantile_95_mm, 1.0);
}

TEST(ArmFit, TooLittleMotionIsAnUncertainCalibration) {
  RigStream rig;
  for (const RigPose& pose : trial().rig.poses()) {
    if (pose.time_s < 10.0) rig.add(pose);
  }
  std::vector<ReferencePose> reference;
  for (const ReferencePose& pose : trial().reference) {
    if (pose.stamp_s < 9.5) reference.push_back(pose);
  }
  const auto little = fit_arm(rig, reference, nominal().arm, {});
  const auto all = fit_arm(trial().rig, trial().reference, nominal().arm, {});
  ASSERT_TRUE(little) << little.error().text();
  ASSERT_TRUE(all);
  for (std::size_t i = 0; i < all->parameters.size(); ++i) {
    EXPECT_GT(little->parameters[i].standard_error, all->parameters[i].standard_error)
        << all->parameters[i].name;
  }
}

TEST(ArmFit, RefusesTooFewPoses) {
  const std::vector<ReferencePose> few(trial().reference.begin(), trial().reference.begin() + 20);
  EXPECT_EQ(test::error_of(fit_arm(trial().rig, few, nominal().arm, {})).what,
            "too few poses of the tracker");
}

TEST(ArmCalibration, CorrectsNothingWithoutAnglesAndSaysSo) {
  const auto fit = test::value_of(fit_arm(trial().rig, trial().reference, nominal().arm, {}));
  hal::RigSample sample = sample_of(trial().rig.poses().front());
  EXPECT_EQ(correct(fit.calibration, sample).source, rt::PoseSource::kAllAngles);
  sample.angles.known = false;
  const rt::CorrectedPose pose = correct(fit.calibration, sample);
  EXPECT_EQ(pose.source, rt::PoseSource::kReported);
  EXPECT_DOUBLE_EQ(pose.tip_mm.x(), sample.tip_position_mm.x);
}

TEST(ArmCalibration, CovarianceOfTheRigsFrameLacksTheRegistration) {
  const auto fit = test::value_of(fit_arm(trial().rig, trial().reference, nominal().arm, {}));
  ArmCalibration c = fit.calibration;
  c.covariance.setZero();
  c.misfit_mm2.setZero();
  c.covariance(parameter::kTranslation, parameter::kTranslation) = 4.0;
  const hal::RigSample sample = sample_of(trial().rig.poses().front());
  EXPECT_NEAR(position_covariance_mm2(c, sample).trace(), 4.0, 1e-9);
  EXPECT_NEAR(position_covariance_mm2(c, sample, Frame::kRig).trace(), 0.0, 1e-12);
}

TEST(Coverage, NamesWhatTheMotionLacks) {
  RigStream rig;
  for (const RigPose& pose : trial().rig.poses()) {
    RigPose still = pose;
    still.angles.joint_rad[0] = 0.0;
    rig.add(still);
  }
  const auto items = coverage_of(CalibrationKind::kKinematics, rig, trial().reference);
  EXPECT_EQ(items.front().name, "joint_1_range");
  EXPECT_FALSE(items.front().enough());
  EXPECT_EQ(items.front().instruction, "swing the arm to the left and to the right");
  for (const CoverageItem& item : coverage_of(CalibrationKind::kKinematics, trial().rig, trial().reference)) {
    EXPECT_TRUE(item.enough()) << item.name << " " << item.value;
  }
}

}  // namespace
}  // namespace hapticd::calibration
