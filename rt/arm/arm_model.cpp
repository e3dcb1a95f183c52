#include "rt/arm/arm_model.h"

#include <cmath>

namespace hapticd::rt {

namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Vector3d turned(const std::array<double, 3>& angles, const Vector3d& gain,
                const Vector3d& offset_rad) noexcept {
  return gain.cwiseProduct(Vector3d(angles[0], angles[1], angles[2])) + offset_rad;
}

Quaterniond about(const Vector3d& axis, double angle_rad) noexcept {
  return Quaterniond(AngleAxisd(angle_rad, axis));
}

}  // namespace

Vector3d joint_angles_rad(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept {
  return turned(angles.joint_rad, arm.joint_gain, arm.joint_offset_rad);
}

Vector3d wrist_mm(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept {
  const Vector3d q = joint_angles_rad(arm, angles);
  const double reach_mm = arm.first_link_mm * std::cos(q[1]) + arm.second_link_mm * std::sin(q[2]);
  return arm.rig_from_base *
         Vector3d(reach_mm * std::cos(q[0]), reach_mm * std::sin(q[0]),
                  arm.first_link_mm * std::sin(q[1]) - arm.second_link_mm * std::cos(q[2]));
}

Quaterniond link_orientation(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept {
  const Vector3d q = joint_angles_rad(arm, angles);
  return arm.rig_from_base.rotation * about(Vector3d::UnitZ(), q[0]) * about(Vector3d::UnitY(), -q[2]);
}

Quaterniond tool_orientation(const ArmModel& arm, const hal::DeviceAngles& angles) noexcept {
  const Vector3d g = turned(angles.gimbal_rad, arm.gimbal_gain, arm.gimbal_offset_rad);
  return (link_orientation(arm, angles) * about(Vector3d::UnitZ(), g[0]) * about(Vector3d::UnitY(), g[1]) *
          about(Vector3d::UnitX(), g[2]) * arm.gimbal_to_tool)
      .normalized();
}

}  // namespace hapticd::rt
