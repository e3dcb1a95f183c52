#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "rt/signal/vector.h"
#include "tests/support/turn.h"

namespace hapticd::rt::test {

using hapticd::test::inverse;
using hapticd::test::product;

inline constexpr double kDegree = std::numbers::pi / 180.0;

inline hal::Quaternion turn(const hal::Vector3& unit_axis, double angle_rad) {
  const double s = std::sin(0.5 * angle_rad);
  return {std::cos(0.5 * angle_rad), s * unit_axis.x, s * unit_axis.y, s * unit_axis.z};
}
inline hal::Vector3 random_vector(std::mt19937_64& random, double deviation) {
  std::normal_distribution<double> normal(0.0, deviation);
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}
inline hal::Vector3 random_direction(std::mt19937_64& random) {
  return direction_or(random_vector(random, 1.0), {0.0, 0.0, 1.0});
}
inline hal::Quaternion random_rotation(std::mt19937_64& random) {
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  const hal::Vector3 axis = random_direction(random);
  return turn(axis, angle(random));
}
/// Angle between two vectors; exact for small ones too.
inline double angle_rad(const hal::Vector3& a, const hal::Vector3& b) {
  return std::atan2(norm(cross(a, b)), dot(a, b));
}
inline void expect_near(const hal::Vector3& a, const hal::Vector3& b, double tolerance) {
  EXPECT_LE(norm(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") against (" << b.x
                                    << ", " << b.y << ", " << b.z << ")";
}

}  // namespace hapticd::rt::test
