#include "hal/phantom/kinematics.h"

#include <algorithm>
#include <cmath>

#include "hal/geometry.h"

namespace hapticd::phantom {

namespace {

using geometry::product;

/// Distance of the tip from the vertical axis, signed: behind the axis it is negative.
double reach_mm(const ArmGeometry& arm, const JointAngles& q) noexcept {
  return arm.first_link_mm * std::cos(q[1]) + arm.second_link_mm * std::sin(q[2]);
}

hal::Quaternion about(double x, double y, double z, double angle_rad) noexcept {
  const double s = std::sin(0.5 * angle_rad);
  return {std::cos(0.5 * angle_rad), x * s, y * s, z * s};
}

}  // namespace

hal::Vector3 forward_mm(const ArmGeometry& arm, const JointAngles& q) noexcept {
  const double r = reach_mm(arm, q);
  return {std::cos(q[0]) * r, std::sin(q[0]) * r,
          arm.first_link_mm * std::sin(q[1]) - arm.second_link_mm * std::cos(q[2])};
}

Jacobian jacobian(const ArmGeometry& arm, const JointAngles& q) noexcept {
  const double l1 = arm.first_link_mm;
  const double l2 = arm.second_link_mm;
  const double r = reach_mm(arm, q);
  const double s1 = std::sin(q[0]);
  const double c1 = std::cos(q[0]);
  const double s2 = std::sin(q[1]);
  const double c3 = std::cos(q[2]);
  return {{{-s1 * r, -l1 * c1 * s2, l2 * c1 * c3},
           {c1 * r, -l1 * s1 * s2, l2 * s1 * c3},
           {0.0, l1 * std::cos(q[1]), l2 * std::sin(q[2])}}};
}

double beyond_stops_rad(const ArmGeometry& arm, const JointAngles& q) noexcept {
  double beyond = std::max(q[1] - q[2] - arm.most_q2_over_q3_rad, q[2] - q[1] - arm.most_q3_over_q2_rad);
  for (std::size_t i = 0; i < 3; ++i) {
    beyond = std::max({beyond, q[i] - arm.high_rad[i], arm.low_rad[i] - q[i]});
  }
  return beyond;
}

std::array<double, 3> torques_for_n_mm(const ArmGeometry& arm, const JointAngles& q,
                                       const hal::Vector3& force_n) noexcept {
  const Jacobian j = jacobian(arm, q);
  std::array<double, 3> torque{};
  for (std::size_t i = 0; i < 3; ++i) {
    torque[i] = j[0][i] * force_n.x + j[1][i] * force_n.y + j[2][i] * force_n.z;
  }
  return torque;
}

hal::Quaternion orientation(const JointAngles& q, const std::array<double, 3>& gimbal_rad) noexcept {
  const hal::Quaternion arm = product(about(0.0, 0.0, 1.0, q[0]), about(0.0, 1.0, 0.0, -q[2]));
  const hal::Quaternion gimbal =
      product(about(0.0, 0.0, 1.0, gimbal_rad[0]),
              product(about(0.0, 1.0, 0.0, gimbal_rad[1]), about(1.0, 0.0, 0.0, gimbal_rad[2])));
  return product(arm, gimbal);
}

}  // namespace hapticd::phantom
