#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "hal/samples.h"

namespace hapticd::test {

/// a after b: rotates by b, then by a.
inline hal::Quaternion product(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

inline hal::Quaternion inverse(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}

inline hal::Vector3 turned(const hal::Quaternion& q, const hal::Vector3& v) noexcept {
  const hal::Quaternion r = product(product(q, {0.0, v.x, v.y, v.z}), inverse(q));
  return {r.x, r.y, r.z};
}

/// Turn by so many degrees about an axis of any length.
inline hal::Quaternion turn_about(const hal::Vector3& axis, double angle_deg) noexcept {
  const double half_rad = 0.5 * angle_deg * 3.14159265358979323846 / 180.0;
  const double scale = std::sin(half_rad) / std::sqrt(dot(axis, axis));
  return {std::cos(half_rad), axis.x * scale, axis.y * scale, axis.z * scale};
}

/// The simulated world lies in the rig turned by this: the hand, which presses along -z and strokes along x,
/// then presses along `press` and strokes along the part of `line` that is across it. Both of any length.
inline hal::Quaternion turn_of_world(const hal::Vector3& press, const hal::Vector3& line) noexcept {
  const Eigen::Vector3d along(line.x, line.y, line.z);
  Eigen::Matrix3d axes;
  axes.col(2) = -Eigen::Vector3d(press.x, press.y, press.z).normalized();
  axes.col(0) = (along - along.dot(axes.col(2)) * axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Quaterniond q(axes);
  return {q.w(), q.x(), q.y(), q.z()};
}

}  // namespace hapticd::test
