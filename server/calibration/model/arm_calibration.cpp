#include "server/calibration/model/arm_calibration.h"

#include <array>
#include <cmath>

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

using PositionJacobian = Eigen::Matrix<double, 3, parameter::kCount>;

bool angles_serve(const ArmCalibration& calibration, const hal::RigSample& sample) noexcept {
  return calibration.arm.use != AngleUse::kNone && sample.angles.known;
}

/// Position of the tip and its derivative, both in the rig's frame; likewise the tool's small turn.
struct Sensitivity {
  PositionJacobian tip = PositionJacobian::Zero();
  PositionJacobian turn = PositionJacobian::Zero();
};

CorrectedPose corrected(const ArmModel& arm, const ArmModel& nominal, const hal::RigSample& sample) noexcept {
  CorrectedPose pose;
  if (arm.use == AngleUse::kPose) {
    pose.orientation = tool_orientation(arm, sample.angles);
    pose.source = PoseSource::kAllAngles;
  } else {
    const auto& q = sample.tip_orientation;
    const Quaterniond reported = Quaterniond(q.w, q.x, q.y, q.z).normalized();
    pose.orientation = (link_orientation(arm, sample.angles) *
                        link_orientation(nominal, sample.angles).conjugate() * reported)
                           .normalized();
    pose.source = PoseSource::kJointAngles;
  }
  pose.tip_mm = wrist_mm(arm, sample.angles) + pose.orientation * arm.tip_offset_mm;
  return pose;
}

double& component(ArmModel& arm, int index) noexcept {
  using namespace parameter;
  if (index < kJointOffset) return arm.joint_gain[index - kJointGain];
  if (index < kLink) return arm.joint_offset_rad[index - kJointOffset];
  if (index == kLink) return arm.first_link_mm;
  if (index == kLink + 1) return arm.second_link_mm;
  if (index < kGimbalOffset) return arm.gimbal_gain[index - kGimbalGain];
  if (index < kTipOffset) return arm.gimbal_offset_rad[index - kGimbalOffset];
  return arm.tip_offset_mm[index - kTipOffset];
}

Sensitivity sensitivity(const ArmCalibration& calibration, const hal::RigSample& sample) noexcept {
  Sensitivity s;
  if (!angles_serve(calibration, sample)) return s;
  // Central differences: the functions are sines of order one, so a step of 1e-5 leaves 1e-10.
  constexpr double kStep = 1e-5;
  ArmModel moved = calibration.arm;
  for (int i = 0; i < parameter::kRotation; ++i) {
    double& value = component(moved, i);
    const double at = value;
    value = at + kStep;
    const CorrectedPose above = corrected(moved, calibration.nominal, sample);
    value = at - kStep;
    const CorrectedPose below = corrected(moved, calibration.nominal, sample);
    value = at;
    s.tip.col(i) = (above.tip_mm - below.tip_mm) / (2.0 * kStep);
    s.turn.col(i) = turn_of(above.orientation * below.orientation.conjugate()) / (2.0 * kStep);
  }
  return s;
}

Matrix3d cross_matrix(const Vector3d& v) noexcept {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace

CorrectedPose correct(const ArmCalibration& calibration, const hal::RigSample& sample) noexcept {
  if (angles_serve(calibration, sample)) return corrected(calibration.arm, calibration.nominal, sample);
  const auto& q = sample.tip_orientation;
  const auto& p = sample.tip_position_mm;
  return {Vector3d(p.x, p.y, p.z), Quaterniond(q.w, q.x, q.y, q.z).normalized(), PoseSource::kReported};
}

RigidTransform frame_from_rig(const ArmCalibration& calibration, Frame frame) noexcept {
  switch (frame) {
    case Frame::kRig:
      break;
    case Frame::kDevice:
      return calibration.device_from_rig;
    case Frame::kReference:
      return calibration.reference_from_rig;
  }
  return {};
}

CorrectedPose in_frame(const ArmCalibration& calibration, const CorrectedPose& in_rig, Frame frame) noexcept {
  const RigidTransform to = frame_from_rig(calibration, frame);
  return {to * in_rig.tip_mm, (to.rotation * in_rig.orientation).normalized(), in_rig.source};
}

Matrix3d position_covariance_mm2(const ArmCalibration& calibration, const hal::RigSample& sample,
                                 Frame frame) noexcept {
  const Matrix3d to = frame_from_rig(calibration, frame).rotation.toRotationMatrix();
  PositionJacobian j = to * sensitivity(calibration, sample).tip;
  if (frame == Frame::kReference) {
    j.middleCols<3>(parameter::kRotation) = -cross_matrix(to * correct(calibration, sample).tip_mm);
    j.middleCols<3>(parameter::kTranslation) = Matrix3d::Identity();
  }
  return j * calibration.covariance * j.transpose() + to * calibration.misfit_mm2 * to.transpose();
}

double orientation_sd_rad(const ArmCalibration& calibration, const hal::RigSample& sample,
                          Frame frame) noexcept {
  const Matrix3d to = frame_from_rig(calibration, frame).rotation.toRotationMatrix();
  PositionJacobian j = to * sensitivity(calibration, sample).turn;
  if (frame == Frame::kReference) j.middleCols<3>(parameter::kRotation) = Matrix3d::Identity();
  const double square = (j * calibration.covariance * j.transpose()).trace();
  const double misfit = calibration.orientation_misfit_rad;
  return std::sqrt(std::max(0.0, square) + misfit * misfit);
}

}  // namespace hapticd::calibration
