#include "hal/phantom/kinematics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/geometry.h"

namespace hapticd::phantom {

namespace {

using geometry::product;

constexpr double kNearAxisMm = 1e-9;
/// Bounds below which the damped inverse departs from the exact one: a tip this near the vertical axis, an
/// elbow this near straight. The stops keep the elbow's cosine above 0.42.
constexpr double kDampedReachMm = 10.0;
constexpr double kDampedElbowCosine = 0.1;

/// Distance of the tip from the vertical axis, signed: behind the axis it is negative.
double reach_mm(const ArmGeometry& arm, const JointAngles& q) noexcept {
  return arm.first_link_mm * std::cos(q[1]) + arm.second_link_mm * std::sin(q[2]);
}

/// 1/x, bounded: x/floor² where |x| < floor.
double damped_reciprocal(double x, double floor) noexcept {
  return std::abs(x) >= floor ? 1.0 / x : x / (floor * floor);
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

std::optional<JointAngles> inverse(const ArmGeometry& arm, const hal::Vector3& tip_mm,
                                   double near_q1_rad) noexcept {
  const double l1 = arm.first_link_mm;
  const double l2 = arm.second_link_mm;
  // q1 stays within a quarter turn, so the side of the axis the tip is on shows the sign of its reach.
  const double distance_mm = std::hypot(tip_mm.x, tip_mm.y);
  if (!std::isfinite(distance_mm) || !std::isfinite(tip_mm.z)) return std::nullopt;
  double q1 = near_q1_rad;
  double r = 0.0;
  if (distance_mm > kNearAxisMm) {
    r = tip_mm.x >= 0.0 ? distance_mm : -distance_mm;
    q1 = tip_mm.x >= 0.0 ? std::atan2(tip_mm.y, tip_mm.x) : std::atan2(-tip_mm.y, -tip_mm.x);
  }
  // The stops keep q3 - q2 within a quarter turn, which allows only one elbow.
  const double sine = (r * r + tip_mm.z * tip_mm.z - l1 * l1 - l2 * l2) / (2.0 * l1 * l2);
  constexpr double kRounding = 1e-12;
  if (!(std::abs(sine) <= 1.0 + kRounding)) return std::nullopt;
  const double elbow = std::asin(std::clamp(sine, -1.0, 1.0));  // q3 - q2
  const double from_first_link = std::atan2(-l2 * std::cos(elbow), l1 + l2 * std::sin(elbow));
  double q2 = std::atan2(tip_mm.z, r) - from_first_link;
  q2 = std::remainder(q2, 2.0 * std::numbers::pi);
  return JointAngles{q1, q2, q2 + elbow};
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

// The problem separates: q1 alone pushes sideways, q2 and q3 push within the vertical plane of the arm.
hal::Vector3 force_of_n(const ArmGeometry& arm, const JointAngles& q,
                        const std::array<double, 3>& torque_n_mm) noexcept {
  const double l1 = arm.first_link_mm;
  const double l2 = arm.second_link_mm;
  const double sideways_n = torque_n_mm[0] * damped_reciprocal(reach_mm(arm, q), kDampedReachMm);
  // [τ2 τ3] = [[-l1 s2, l1 c2], [l2 c3, l2 s3]] [f_r f_z]; determinant -l1 l2 cos(q2 - q3).
  const double inverse_determinant =
      -damped_reciprocal(std::cos(q[1] - q[2]), kDampedElbowCosine) / (l1 * l2);
  const double radial_n =
      inverse_determinant * (l2 * std::sin(q[2]) * torque_n_mm[1] - l1 * std::cos(q[1]) * torque_n_mm[2]);
  const double upward_n =
      inverse_determinant * (-l2 * std::cos(q[2]) * torque_n_mm[1] - l1 * std::sin(q[1]) * torque_n_mm[2]);
  const double s1 = std::sin(q[0]);
  const double c1 = std::cos(q[0]);
  return {c1 * radial_n - s1 * sideways_n, s1 * radial_n + c1 * sideways_n, upward_n};
}

hal::Quaternion orientation(const JointAngles& q, const std::array<double, 3>& gimbal_rad) noexcept {
  const hal::Quaternion arm = product(about(0.0, 0.0, 1.0, q[0]), about(0.0, 1.0, 0.0, -q[2]));
  const hal::Quaternion gimbal =
      product(about(0.0, 0.0, 1.0, gimbal_rad[0]),
              product(about(0.0, 1.0, 0.0, gimbal_rad[1]), about(1.0, 0.0, 0.0, gimbal_rad[2])));
  return product(arm, gimbal);
}

}  // namespace hapticd::phantom
