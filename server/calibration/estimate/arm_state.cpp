#include "server/calibration/estimate/arm_state.h"

#include <numbers>

namespace hapticd::calibration {

namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

PoseResidual difference(const ArmState& state, const rt::RigidTransform& tool, const ReferencePose& seen,
                        const Vector3d& marker_or_tip_mm, const Vector3d& seen_mm) {
  PoseResidual r;
  r.head<3>() = seen_mm - state.reference_from_rig * (tool * marker_or_tip_mm);
  r.tail<3>().setZero();
  if (seen.orientation) {
    const Quaterniond model = state.reference_from_rig.rotation * tool.rotation * state.tool_from_marker;
    r.tail<3>() = rt::turn_of(model.conjugate() * *seen.orientation);
  }
  return r;
}

}  // namespace

ArmState ArmState::moved(const UnknownVector& step) const {
  ArmState m = *this;
  m.arm.joint_gain += step.segment<3>(parameter::kJointGain);
  m.arm.joint_offset_rad += step.segment<3>(parameter::kJointOffset);
  m.arm.first_link_mm += step[parameter::kLink];
  m.arm.second_link_mm += step[parameter::kLink + 1];
  m.arm.gimbal_gain += step.segment<3>(parameter::kGimbalGain);
  m.arm.gimbal_offset_rad += step.segment<3>(parameter::kGimbalOffset);
  m.reference_from_rig.rotation =
      (rt::rotation_by(step.segment<3>(unknown::kRotation)) * reference_from_rig.rotation).normalized();
  m.reference_from_rig.translation_mm += step.segment<3>(unknown::kTranslation);
  m.marker_mm += step.segment<3>(unknown::kMarker);
  m.tool_from_marker =
      (rt::rotation_by(step.segment<3>(unknown::kMarkerTurn)) * tool_from_marker).normalized();
  m.latency_s += step[unknown::kLatency];
  m.drift += step[unknown::kDrift];
  m.play_rad += step.segment<3>(unknown::kPlay);
  return m;
}

rt::RigidTransform tool_pose(const ArmState& state, const RigPose& pose) {
  if (state.arm.use == rt::AngleUse::kNone) return {pose.orientation, pose.tip_mm};
  if (state.arm.use == rt::AngleUse::kPose) {
    return {tool_orientation(state.arm, pose.angles), wrist_mm(state.arm, pose.angles)};
  }
  return {(link_orientation(state.arm, pose.angles) *
           link_orientation(state.nominal, pose.angles).conjugate() * pose.orientation)
              .normalized(),
          wrist_mm(state.arm, pose.angles)};
}

std::optional<PoseResidual> residual_of(const ArmState& state, const RigStream& rig,
                                        const ReferencePose& seen) {
  const double time_s = state.rig_time_s(seen.stamp_s);
  auto pose = rig.at(time_s);
  if (!pose) return std::nullopt;
  if (!state.play_rad.isZero()) {
    const Vector3d direction = rig.gimbal_direction(time_s);
    for (int i = 0; i < 3; ++i) {
      pose->angles.gimbal_rad[static_cast<std::size_t>(i)] += state.play_rad[i] * direction[i];
    }
  }
  return difference(state, tool_pose(state, *pose), seen, state.marker_mm, seen.position_mm);
}

std::optional<PoseResidual> target_residual_of(const ArmState& state, const RigStream& rig,
                                               const ReferencePose& seen) {
  if (!seen.orientation) return residual_of(state, rig, seen);
  const auto pose = rig.at(state.rig_time_s(seen.stamp_s));
  if (!pose) return std::nullopt;
  const Vector3d tip_mm = state.arm.tip_offset_mm;
  const Vector3d from_marker =
      *seen.orientation * (state.tool_from_marker.conjugate() * Vector3d(tip_mm - state.marker_mm));
  return difference(state, tool_pose(state, *pose), seen, tip_mm, seen.position_mm + from_marker);
}

std::array<bool, unknown::kCount> active_unknowns(FitMethod method, rt::AngleUse use, bool has_orientation,
                                                  bool clock_drifts) {
  std::array<bool, unknown::kCount> active{};
  const auto set = [&active](int first, int count) {
    for (int i = 0; i < count; ++i) active[static_cast<std::size_t>(first + i)] = true;
  };
  const bool with_arm = method == FitMethod::kArm || method == FitMethod::kArmNoLatency;
  if (with_arm && use != rt::AngleUse::kNone) {
    set(parameter::kJointGain, 3);
    set(parameter::kJointOffset + 1, 2);  // the first is the registration's
    set(parameter::kLink, 2);
    if (use == rt::AngleUse::kPose) {
      set(parameter::kGimbalGain, 3);
      set(parameter::kGimbalOffset, 2);  // the last is the marker's
      if (has_orientation && method == FitMethod::kArm) set(unknown::kPlay, 3);
    }
  }
  set(unknown::kRotation, 6);
  set(unknown::kMarker, 3);
  if (has_orientation) set(unknown::kMarkerTurn, 3);
  if (method == FitMethod::kArm || method == FitMethod::kRigidLatency) {
    set(unknown::kLatency, 1);
    if (clock_drifts) set(unknown::kDrift, 1);
  }
  return active;
}

UnknownVector prior_sd() {
  constexpr double kGain = 0.05;
  constexpr double kZeroRad = 4.0 * std::numbers::pi / 180.0;
  constexpr double kLinkMm = 8.0;
  UnknownVector sd = UnknownVector::Zero();
  sd.segment<3>(parameter::kJointGain).setConstant(kGain);
  sd.segment<3>(parameter::kJointOffset).setConstant(kZeroRad);
  sd.segment<2>(parameter::kLink).setConstant(kLinkMm);
  sd.segment<3>(parameter::kGimbalGain).setConstant(2.0 * kGain);
  sd.segment<3>(parameter::kGimbalOffset).setConstant(2.0 * kZeroRad);
  sd.segment<3>(unknown::kMarker).setConstant(300.0);
  sd[unknown::kDrift] = 5e-4;
  sd.segment<3>(unknown::kPlay).setConstant(0.01);
  return sd;
}

}  // namespace hapticd::calibration
