#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace hapticd::rt {

inline constexpr double kDegPerRad = 180.0 / std::numbers::pi;

/// A pose, or the change from one frame to another: p_to = rotation · p_from + translation.
struct RigidTransform {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& point_mm) const noexcept {
    return rotation * point_mm + translation_mm;
  }
  RigidTransform operator*(const RigidTransform& first) const noexcept {
    return {(rotation * first.rotation).normalized(), *this * first.translation_mm};
  }
  RigidTransform inverse() const noexcept {
    const Eigen::Quaterniond back = rotation.conjugate();
    return {back, -(back * translation_mm)};
  }
};

/// The rotation about a vector by its length, rad.
inline Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn_rad) noexcept {
  const double half = 0.5 * turn_rad.norm();
  // sin(h)/h to rounding error if h² vanishes against 1.
  const double scale = half > 1e-8 ? 0.5 * std::sin(half) / half : 0.5;
  const Eigen::Vector3d axis = scale * turn_rad;
  return Eigen::Quaterniond(std::cos(half), axis.x(), axis.y(), axis.z()).normalized();
}

/// The vector of rotation_by(), of length 0 … pi.
inline Eigen::Vector3d turn_of(const Eigen::Quaterniond& q) noexcept {
  const Eigen::Vector3d axis = q.w() < 0.0 ? Eigen::Vector3d(-q.vec()) : Eigen::Vector3d(q.vec());
  const double sine = axis.norm();
  if (sine < 1e-12) return 2.0 * axis;
  return axis * (2.0 * std::atan2(sine, std::abs(q.w())) / sine);
}

}  // namespace hapticd::rt
