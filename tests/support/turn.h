#pragma once

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
  const auto of_length_1 = [](const hal::Vector3& v) { return v * (1.0 / std::sqrt(dot(v, v))); };
  const hal::Vector3 z = of_length_1(press) * -1.0;
  const hal::Vector3 x = of_length_1(line - z * dot(line, z));
  const hal::Vector3 y{z.y * x.z - z.z * x.y, z.z * x.x - z.x * x.z, z.x * x.y - z.y * x.x};
  // Columns x y z of the rotation; the largest of the four components first.
  const double trace = x.x + y.y + z.z;
  hal::Quaternion q;
  if (trace > 0.0) {
    const double s = 2.0 * std::sqrt(trace + 1.0);
    q = {0.25 * s, (y.z - z.y) / s, (z.x - x.z) / s, (x.y - y.x) / s};
  } else if (x.x > y.y && x.x > z.z) {
    const double s = 2.0 * std::sqrt(1.0 + x.x - y.y - z.z);
    q = {(y.z - z.y) / s, 0.25 * s, (y.x + x.y) / s, (z.x + x.z) / s};
  } else if (y.y > z.z) {
    const double s = 2.0 * std::sqrt(1.0 + y.y - x.x - z.z);
    q = {(z.x - x.z) / s, (y.x + x.y) / s, 0.25 * s, (z.y + y.z) / s};
  } else {
    const double s = 2.0 * std::sqrt(1.0 + z.z - x.x - y.y);
    q = {(x.y - y.x) / s, (z.x + x.z) / s, (z.y + y.z) / s, 0.25 * s};
  }
  return q;
}

}  // namespace hapticd::test
