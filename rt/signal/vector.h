#pragma once

#include <algorithm>
#include <cmath>

#include "hal/samples.h"

namespace hapticd::rt {

/// What the stages need of three components beyond sums and products.

inline double norm(const hal::Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}
constexpr hal::Vector3 cross(const hal::Vector3& a, const hal::Vector3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// The part of v in the plane across a unit vector.
constexpr hal::Vector3 across(const hal::Vector3& v, const hal::Vector3& unit) noexcept {
  return v - unit * dot(v, unit);
}
/// v of length 1; `otherwise` where v is too short to have a direction.
inline hal::Vector3 direction_or(const hal::Vector3& v, const hal::Vector3& otherwise) noexcept {
  const double length = norm(v);
  return length > 1e-12 ? v * (1.0 / length) : otherwise;
}
/// q of length 1, however a driver rounded it; upright where it has no length at all.
inline hal::Quaternion unit(const hal::Quaternion& q) noexcept {
  const double squared = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
  if (!(squared > 1e-12)) return {};
  const double scale = 1.0 / std::sqrt(squared);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}
/// The rotation back; q of length 1.
constexpr hal::Quaternion conjugate(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}
/// Tool coordinates into rig coordinates; q of length 1.
constexpr hal::Vector3 rotated(const hal::Quaternion& q, const hal::Vector3& v) noexcept {
  const hal::Vector3 axis{q.x, q.y, q.z};
  const hal::Vector3 t = cross(axis, v) * 2.0;
  return v + t * q.w + cross(axis, t);
}

/// First b, then a.
constexpr hal::Quaternion product(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// Magnitude and dead zone alike for one component and for three.
inline double magnitude(double v) noexcept {
  return std::abs(v);
}
inline double magnitude(const hal::Vector3& v) noexcept {
  return norm(v);
}
inline double shortened(double v, double by) noexcept {
  return std::copysign(std::max(0.0, std::abs(v) - by), v);
}
inline hal::Vector3 shortened(const hal::Vector3& v, double by) noexcept {
  const double length = norm(v);
  return length > by ? v * (1.0 - by / length) : hal::Vector3{};
}

}  // namespace hapticd::rt
