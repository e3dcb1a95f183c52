#pragma once

#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

/// One step of Dahl's equation (4.12), α = 1, in the state z = f/f_c: exact for motion in one direction,
///   z⁺ = s + (z - s) exp(-|Δx|/δ),  s = Δx/|Δx|.
/// (4.14) counts the way since the last reset although it starts from the present friction; this counts the
/// step's own. As a convex combination it never leaves |z| ≤ 1, needs no reset at zero velocity, does not
/// move at Δx = 0 for however long, and is defined at zero load. δ → 0 is Coulomb friction.
inline double dahl_step(double z, double slide_mm, double presliding_mm) noexcept {
  if (slide_mm == 0.0) return z;
  const double s = std::copysign(1.0, slide_mm);
  return presliding_mm > 0.0 ? s + (z - s) * std::exp(-std::abs(slide_mm) / presliding_mm) : s;
}

/// The same in the tangent plane: z points along the sliding that built it up.
inline hal::Vector3 dahl_step(const hal::Vector3& z, const hal::Vector3& slide_mm,
                              double presliding_mm) noexcept {
  const double way_mm = norm(slide_mm);
  if (!(way_mm > 1e-12)) return z;
  const hal::Vector3 s = slide_mm * (1.0 / way_mm);
  return presliding_mm > 0.0 ? s + (z - s) * std::exp(-way_mm / presliding_mm) : s;
}

}  // namespace hapticd::rt
