#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>

#include "hal/samples.h"
#include "rt/arm/rigid_transform.h"

namespace hapticd::rt {

/// What of a pose the device's angles describe.
enum class AngleUse : std::uint8_t {
  kNone,      ///< nothing: the device has no angles, or they describe no arm of two links
  kPosition,  ///< the position; the orientation is the reported one, turned as the arm's correction turns
  kPose,      ///< position and orientation
};

/// An arm of two links on a base that turns, with a gimbal: from the device's angles O to the tip.
///
///   q_i = gain_i O_i + offset_i                                (joints, then gimbal)
///   r = l1 cos q2 + l2 sin q3,  wrist = base · (r cos q1, r sin q1, l1 sin q2 - l2 cos q3)
///   tool = base.rotation · Rz(q1) Ry(-q3) Rz(g1) Ry(g2) Rx(g3) · gimbal_to_tool
///   tip = wrist + tool · tip_offset
///
/// q3 is absolute: the linkage carries the second motor's turn past the elbow, as in a PHANToM. The signs of
/// a device's angles are those of its gains.
struct ArmModel {
  AngleUse use = AngleUse::kNone;
  RigidTransform rig_from_base;
  double first_link_mm = 0.0;
  double second_link_mm = 0.0;
  Eigen::Vector3d joint_gain = Eigen::Vector3d::Ones();
  Eigen::Vector3d joint_offset_rad = Eigen::Vector3d::Zero();
  Eigen::Vector3d gimbal_gain = Eigen::Vector3d::Ones();
  Eigen::Vector3d gimbal_offset_rad = Eigen::Vector3d::Zero();
  Eigen::Quaterniond gimbal_to_tool = Eigen::Quaterniond::Identity();
  Eigen::Vector3d tip_offset_mm = Eigen::Vector3d::Zero();  ///< from the wrist, tool frame
};

/// The joints' angles q.
Eigen::Vector3d joint_angles_rad(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept;

/// Point at which the gimbal's axes meet, rig frame.
Eigen::Vector3d wrist_mm(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept;

/// Rotation of the second link, rig frame.
Eigen::Quaterniond link_orientation(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept;

/// Rotation from tool coordinates into the rig's, by joints and gimbal.
Eigen::Quaterniond tool_orientation(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept;

}  // namespace hapticd::rt
