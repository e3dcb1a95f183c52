#include "hal/sim/device/arm_unevenness.h"

#include <cmath>
#include <numbers>

namespace hapticd::sim {

namespace {

constexpr std::array<double, 3> kAlong{1.0, 0.0, -1.0};  // x heavier, z lighter

/// A wave through the workspace for each axis, each along its own direction; between -1 and 1.
double wave(std::size_t axis, const hal::Vector3& p, double wavelength_mm) noexcept {
  constexpr std::array<hal::Vector3, 3> kDirections{hal::Vector3{0.8, 0.6, 0.0}, hal::Vector3{0.0, 0.8, 0.6},
                                                    hal::Vector3{0.6, 0.0, 0.8}};
  return std::sin(2.0 * std::numbers::pi * dot(kDirections[axis], p) / wavelength_mm +
                  static_cast<double>(axis));
}
constexpr double kMassWavelengthMm = 250.0;
constexpr double kFrictionWavelengthMm = 90.0;

}  // namespace

ArmUnevenness::ArmUnevenness(const Conditions& c) noexcept
    : mass_anisotropy_(c.mass_anisotropy_share),
      mass_pose_(c.mass_pose_share),
      friction_anisotropy_(c.friction_anisotropy_share),
      friction_pose_(c.friction_pose_share) {}

double ArmUnevenness::mass_factor(std::size_t axis, const hal::Vector3& at_mm) const noexcept {
  return 1.0 + mass_anisotropy_ * kAlong[axis] + mass_pose_ * wave(axis, at_mm, kMassWavelengthMm);
}

double ArmUnevenness::friction_factor(std::size_t axis, const hal::Vector3& at_mm) const noexcept {
  return 1.0 + friction_anisotropy_ * kAlong[axis] +
         friction_pose_ * wave(axis, at_mm, kFrictionWavelengthMm);
}

}  // namespace hapticd::sim
