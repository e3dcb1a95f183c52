#pragma once

#include <cmath>

#include "rt/inclusion/inclusion_energy.h"
#include "rt/signal/vector.h"
#include "tests/support/value_of.h"

namespace hapticd::identification::test {

using hapticd::test::value_of;

/// Radius of the round object that inclusions are hidden in; its uppermost point is the origin.
inline constexpr double kRadiusMm = 60.0;

/// How far below its uppermost point the object's surface is.
inline double surface_z_mm(double x, double y, double radius_mm = kRadiusMm) {
  return std::sqrt(radius_mm * radius_mm - x * x - y * y) - radius_mm;
}

/// An inclusion below that place of the surface, `depth_mm` along its normal.
inline rt::InclusionParameters inclusion_at(double x, double y, double depth_mm) {
  rt::InclusionParameters inclusion;
  inclusion.surface_mm = {x, y, surface_z_mm(x, y)};
  const hal::Vector3 from_centre = inclusion.surface_mm + hal::Vector3{0.0, 0.0, kRadiusMm};
  inclusion.place_mm = inclusion.surface_mm - from_centre * (depth_mm / rt::norm(from_centre));
  inclusion.response = {0.03, 2e-5, 2.1};
  inclusion.attenuation = 4.0;
  inclusion.max_displacement_mm = 100.0;
  return inclusion;
}

}  // namespace hapticd::identification::test
