#pragma once

#include <cmath>
#include <cstddef>

#include "hal/samples.h"

namespace hapticd::sim {

using hal::Vector3;

inline double& component(Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}
inline double component(const Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}

/// R^T v for the tool's orientation.
inline Vector3 to_tool(const hal::Quaternion& q, const Vector3& v) noexcept {
  const Vector3 axis{-q.x, -q.y, -q.z};
  const auto cross = [](const Vector3& a, const Vector3& b) {
    return Vector3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const Vector3 t = cross(axis, v) * 2.0;
  return v + t * q.w + cross(axis, t);
}

inline Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline hal::Quaternion inverse(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}
inline bool is_zero(const Vector3& v) noexcept {
  return dot(v, v) == 0.0;
}

/// Rotation by the length of a vector about its direction.
inline hal::Quaternion rotation(const Vector3& rad) noexcept {
  const double half = 0.5 * std::sqrt(dot(rad, rad));
  const double share = half > 1e-12 ? 0.5 * std::sin(half) / half : 0.5;
  return {std::cos(half), share * rad.x, share * rad.y, share * rad.z};
}

/// First b, then a.
inline hal::Quaternion composed(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

}  // namespace hapticd::sim
