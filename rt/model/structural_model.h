#pragma once

#include <array>

#include "hal/samples.h"

namespace hapticd::rt {

/// Structural compliance of a device: the tip gives way by c(p) f_d against the encoders, (4.26). As a field
///   c(p) = c_0 (1 + g·q + q·H q),  q = p - centre,
/// with H's upper triangle (xx, yy, zz, xy, xz, yz); a constant one has g = 0 and H = 0.
struct StructuralModel {
  /// Maximum ratio of what stiffness_at() makes of any place to that of the centre, and back.
  static constexpr double kMaxRatio = 2.0;

  double stiffness_n_per_mm = 0.0;  ///< 1/c_0, at the centre
  hal::Vector3 centre_mm;
  hal::Vector3 gradient_per_mm;                 ///< g
  std::array<double, 6> curvature_per_mm2{};    ///< H
  hal::Vector3 covered_from_mm, covered_to_mm;  ///< where taps were taken

  /// Stiffness at the tip's place; within a factor of kMaxRatio of the centre's, whatever the place.
  double stiffness_at(const hal::Vector3& position_mm) const noexcept;
  /// c(p)/c_0 as the polynomial has it, without bounds.
  double relative_compliance(const hal::Vector3& position_mm) const noexcept;
  /// Corners of the box that taps were taken in.
  std::array<hal::Vector3, 8> corners_mm() const noexcept;
};

}  // namespace hapticd::rt
