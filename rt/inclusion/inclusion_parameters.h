#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/samples.h"
#include "rt/deformation/hunt_crossley.h"

namespace hapticd::rt {

enum class InclusionVariant : std::uint8_t {
  kEnergy,     ///< the force is the gradient of an energy
  kPublished,  ///< (5.4) to (5.7)
};

/// A stiff sphere that is not there (D§5): what it adds to the force of the real object. Rig frame.
struct InclusionParameters {
  InclusionVariant variant = InclusionVariant::kEnergy;
  /// Identified model that place, response, attenuation and approach are to be taken from; empty once they
  /// are, or if they are given.
  std::string model{};
  hal::Vector3 place_mm;    ///< p_t, of its centre without load
  hal::Vector3 surface_mm;  ///< p_ts, the nearest point of the surface without load
  /// H_t (5.3): what it adds when the tip presses along l_0, from p_ts to p_t.
  HuntCrossleyParameters response;
  double max_displacement_mm = 15.0;  ///< that the response was identified to; beyond, its slope fades

  // kEnergy only.
  double attenuation = 6.0;        ///< exponent n of the distance: 6 for a point load on a half-space
  double approach = 0.5;           ///< β: how far tip and sphere approach each other, over the displacement
  double internal_friction = 0.0;  ///< of the sphere in the tissue, over the force that it adds
  double internal_presliding_mm = 0.3;

  /// Distance at which it is to lie from there, x and y of its surface point; zero once it does. Around this
  /// point on a round object.
  std::array<double, 2> moved_mm{};
  std::optional<hal::Vector3> object_centre_mm{};
};

/// Checks that all is finite and in range: l_0 from 2 to 200 mm, exponents 1 … 4 and 2 … 12, β 0 … 0.9,
/// friction 0 … 1. The error names the key, after `prefix`.
std::optional<hal::Error> check(const InclusionParameters& inclusion, const std::string& prefix,
                                const std::string& where);

}  // namespace hapticd::rt
