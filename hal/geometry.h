#pragma once

#include <cmath>

#include "hal/samples.h"

namespace hapticd::geometry {

/// Vectors and rotations, for drivers and stages. The simulation has its own: it shares no code with what it
/// tests.

inline double norm(const hal::Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}
constexpr hal::Vector3 cross(const hal::Vector3& a, const hal::Vector3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// q of length 1, however a driver rounded it; upright if it has no length at all.
inline hal::Quaternion unit(const hal::Quaternion& q) noexcept {
  const double squared = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (!(squared > 1e-12)) return {};
  const double scale = 1.0 / std::sqrt(squared);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}
/// Rotation back; q of length 1.
constexpr hal::Quaternion conjugate(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}
/// v turned by q, of length 1: tool coordinates into rig coordinates if q is the tool's orientation.
constexpr hal::Vector3 rotated(const hal::Quaternion& q, const hal::Vector3& v) noexcept {
  const hal::Vector3 axis{q.x, q.y, q.z};
  const hal::Vector3 t = cross(axis, v) * 2.0;
  return v + t * q.w + cross(axis, t);
}

/// Product of two rotations: first b, then a.
constexpr hal::Quaternion product(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

}  // namespace hapticd::geometry
