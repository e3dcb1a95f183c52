#include "server/calibration/model/arm_calibration.h"

#include <cmath>

namespace hapticd::calibration {

namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

using PositionJacobian = Eigen::Matrix<double, 3, parameter::kCount>;

/// Position of the tip and its derivative, both in the rig's frame; likewise the tool's small turn.
struct Sensitivity {
  PositionJacobian tip = PositionJacobian::Zero();
  PositionJacobian turn = PositionJacobian::Zero();
};

double& component(rt::ArmModel& arm, int index) noexcept {
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
  if (!angles_serve(calibration.arm, sample)) return s;
  // Central differences: the functions are sines of order one, so a step of 1e-5 leaves 1e-10.
  constexpr double kStep = 1e-5;
  rt::ArmCorrection moved = calibration;
  for (int i = 0; i < parameter::kRotation; ++i) {
    double& value = component(moved.arm, i);
    const double at = value;
    value = at + kStep;
    const rt::CorrectedPose above = correct(moved, sample);
    value = at - kStep;
    const rt::CorrectedPose below = correct(moved, sample);
    value = at;
    s.tip.col(i) = (above.tip_mm - below.tip_mm) / (2.0 * kStep);
    s.turn.col(i) = rt::turn_of(above.orientation * below.orientation.conjugate()) / (2.0 * kStep);
  }
  return s;
}

Matrix3d cross_matrix(const Vector3d& v) noexcept {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace

rt::RigidTransform frame_from_rig(const ArmCalibration& calibration, Frame frame) noexcept {
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

rt::CorrectedPose in_frame(const ArmCalibration& calibration, const rt::CorrectedPose& in_rig,
                           Frame frame) noexcept {
  const rt::RigidTransform to = frame_from_rig(calibration, frame);
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
