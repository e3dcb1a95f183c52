#include "rt/deformation/hunt_crossley.h"

#include <algorithm>
#include <cmath>

namespace hapticd::rt {

double hunt_crossley_force_n(const HuntCrossleyParameters& law, double displacement_mm,
                             double rate_mm_per_s) noexcept {
  if (!(displacement_mm > 0.0)) return 0.0;
  const double coefficient = law.stiffness_n_per_mm_m + law.damping_n_s_per_mm_m1 * rate_mm_per_s;
  return std::max(0.0, coefficient * std::pow(displacement_mm, law.exponent));
}

LawEstimate hunt_crossley_displacement(const HuntCrossleyParameters& law, double normal_force_n,
                                       double rate_mm_per_s) noexcept {
  constexpr double kMinShare = 0.2;
  constexpr double kMinForceN = 1e-3;
  const double coefficient = std::max(law.stiffness_n_per_mm_m + law.damping_n_s_per_mm_m1 * rate_mm_per_s,
                                      kMinShare * law.stiffness_n_per_mm_m);
  const double force_n = std::max(0.0, normal_force_n);
  const double floor_n = std::max(force_n, kMinForceN);
  const double at_floor = std::pow(floor_n / coefficient, 1.0 / law.exponent);
  const double x = force_n < kMinForceN ? at_floor * (force_n / kMinForceN) : at_floor;
  return {x, at_floor / (law.exponent * floor_n)};
}

}  // namespace hapticd::rt
