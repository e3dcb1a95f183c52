#pragma once

#include <array>

#include "hal/samples.h"

namespace hapticd::phantom {

/// q1 turns the arm about the vertical, q2 is the first link's angle above the horizontal, q3 the second
/// link's from hanging down, forward positive. The linkage carries the second motor's turn past the elbow, so
/// q3 is absolute: moving q2 alone leaves the second link parallel to itself.
using JointAngles = std::array<double, 3>;  // rad
/// Rows x y z [mm/rad], columns joints.
using Jacobian = std::array<std::array<double, 3>, 3>;

/// Lengths and stops of the arm.
struct ArmGeometry {
  double first_link_mm = 215.0;
  double second_link_mm = 170.0;
  JointAngles low_rad{};
  JointAngles high_rad{};
  double most_q2_over_q3_rad = 0.0;  ///< stop of q2 - q3
  double most_q3_over_q2_rad = 0.0;  ///< stop of q3 - q2
};

/// Tip in the device's own frame: origin where the first two axes cross, z up, x forward at q1 = 0, y left.
hal::Vector3 forward_mm(const ArmGeometry& arm, const JointAngles& q) noexcept;

Jacobian jacobian(const ArmGeometry& arm, const JointAngles& q) noexcept;

/// Angle beyond a stop, rad; zero or negative inside.
double beyond_stops_rad(const ArmGeometry& arm, const JointAngles& q) noexcept;

/// Joint torques for a force of the device on the tip, N·mm: Jᵀ f.
std::array<double, 3> torques_for_n_mm(const ArmGeometry& arm, const JointAngles& q,
                                       const hal::Vector3& force_n) noexcept;

/// Orientation of the stylus from the arm and a gimbal's three angles: about the second link, then across,
/// then along the stylus. Upright at q = 0 and angles zero.
hal::Quaternion orientation(const JointAngles& q, const std::array<double, 3>& gimbal_rad) noexcept;

}  // namespace hapticd::phantom
