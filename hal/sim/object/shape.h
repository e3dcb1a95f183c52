#pragma once

#include <variant>

#include "hal/samples.h"

namespace hapticd::sim {

/// Nearest point of an undeformed surface.
struct Projection {
  hal::Vector3 point_mm;
  hal::Vector3 outward_normal{0.0, 0.0, 1.0};
  double depth_mm = 0.0;  ///< of the tip below the surface; negative outside
};

/// All shapes touch z = 0 at x = y = 0, with the object below.
struct Plane {
  Projection project(const hal::Vector3& p) const noexcept;
};

struct Sphere {
  double radius_mm = 40.0;
  Projection project(const hal::Vector3& p) const noexcept;
};

/// Height field z = amplitude · (cos kx cos ky - 1): smooth ridges and dips.
struct WavyField {
  double amplitude_mm = 2.0;
  double wavelength_mm = 40.0;
  /// Nearest point by Newton's method to rounding error, unique as long as the depth stays below the radius
  /// of curvature, 1 / (amplitude (2π / wavelength)²).
  Projection project(const hal::Vector3& p) const noexcept;
};

/// Roof of two planes falling at 45° to the left and right of the y axis, its edge rounded. Exact nearest
/// point. Deeper than the radius below the crest both faces are equally near: there point and normal change
/// sides at x = 0, while the depth stays continuous.
struct Ridge {
  double radius_mm = 3.0;
  Projection project(const hal::Vector3& p) const noexcept;
};

using Shape = std::variant<Plane, Sphere, WavyField, Ridge>;

inline Projection project(const Shape& shape, const hal::Vector3& p) noexcept {
  if (const auto* plane = std::get_if<Plane>(&shape)) return plane->project(p);
  if (const auto* sphere = std::get_if<Sphere>(&shape)) return sphere->project(p);
  if (const auto* ridge = std::get_if<Ridge>(&shape)) return ridge->project(p);
  return std::get_if<WavyField>(&shape)->project(p);
}

}  // namespace hapticd::sim
