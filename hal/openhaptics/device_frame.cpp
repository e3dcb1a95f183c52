#include "hal/openhaptics/device_frame.h"

#include <cmath>

namespace hapticd::openhaptics {

namespace {

using hal::Quaternion;
using hal::Vector3;

constexpr double kMinAxisLength = 0.5;
constexpr double kMaxAxis = 2.0;
constexpr double kMaxSkew = 0.5;  // cosine between two axes: 60° instead of 90°

constexpr Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Quaternion of a rotation matrix (columns), computed from its largest component (Shepperd).
Quaternion from_axes(const Vector3& x, const Vector3& y, const Vector3& z) noexcept {
  const double trace = x.x + y.y + z.z;
  Quaternion q;
  if (trace >= x.x && trace >= y.y && trace >= z.z) {
    q = {1.0 + trace, y.z - z.y, z.x - x.z, x.y - y.x};
  } else if (x.x >= y.y && x.x >= z.z) {
    q = {y.z - z.y, 1.0 + x.x - y.y - z.z, y.x + x.y, z.x + x.z};
  } else if (y.y >= z.z) {
    q = {z.x - x.z, y.x + x.y, 1.0 - x.x + y.y - z.z, z.y + y.z};
  } else {
    q = {x.y - y.x, z.x + x.z, z.y + y.z, 1.0 - x.x - y.y + z.z};
  }
  const double scale = 1.0 / std::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {q.w * scale, q.x * scale, q.y * scale, q.z * scale};
}

}  // namespace

std::optional<Quaternion> orientation_in_rig(const Transform& t) noexcept {
  Vector3 axes[3] = {{t[0], t[1], t[2]}, {t[4], t[5], t[6]}, {t[8], t[9], t[10]}};
  for (Vector3& axis : axes) {
    const double length = std::sqrt(dot(axis, axis));
    if (!(length >= kMinAxisLength && length <= kMaxAxis)) return std::nullopt;  // also for NaN
    axis = axis * (1.0 / length);
  }
  if (std::abs(dot(axes[0], axes[1])) > kMaxSkew || std::abs(dot(axes[1], axes[2])) > kMaxSkew ||
      std::abs(dot(axes[2], axes[0])) > kMaxSkew || !(dot(cross(axes[0], axes[1]), axes[2]) > 0.0)) {
    return std::nullopt;
  }
  // The stylus axis matters most: it is kept, the others are made orthogonal to it.
  const Vector3 z = axes[2];
  Vector3 x = axes[0] - z * dot(axes[0], z);
  x = x * (1.0 / std::sqrt(dot(x, x)));
  const Vector3 y = cross(z, x);
  return from_axes(rig_from_device(x), rig_from_device(y), rig_from_device(z));
}

Quaternion product(const Quaternion& a, const Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

Vector3 rotated(const Quaternion& q, const Vector3& v) noexcept {
  const Vector3 u{q.x, q.y, q.z};
  const Vector3 twice = cross(u, v) * 2.0;
  return v + twice * q.w + cross(u, twice);
}

}  // namespace hapticd::openhaptics
