#pragma once

#include <algorithm>
#include <cmath>

#include "hal/geometry.h"

namespace hapticd::rt {

/// What the stages need of three components beyond sums and products.

using geometry::conjugate;
using geometry::cross;
using geometry::norm;
using geometry::product;
using geometry::rotated;
using geometry::unit;

/// Part of v in the plane across a unit vector.
constexpr hal::Vector3 across(const hal::Vector3& v, const hal::Vector3& unit) noexcept {
  return v - unit * dot(v, unit);
}
/// v of length 1; `otherwise` if v is too short to have a direction.
inline hal::Vector3 direction_or(const hal::Vector3& v, const hal::Vector3& otherwise) noexcept {
  const double length = norm(v);
  return length > 1e-12 ? v * (1.0 / length) : otherwise;
}
constexpr double squared(const hal::Vector3& v) noexcept {
  return dot(v, v);
}
/// |v| > size.
constexpr bool exceeds(const hal::Vector3& v, double size) noexcept {
  return squared(v) > size * size;
}
/// v, no longer than `most`.
inline hal::Vector3 within(const hal::Vector3& v, double most) noexcept {
  return exceeds(v, most) ? v * (most / norm(v)) : v;
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
