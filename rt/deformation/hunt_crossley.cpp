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
  constexpr double kLeastShare = 0.2;
  constexpr double kLeastForceN = 1e-3;
  const double coefficient = std::max(law.stiffness_n_per_mm_m + law.damping_n_s_per_mm_m1 * rate_mm_per_s,
                                      kLeastShare * law.stiffness_n_per_mm_m);
  const double force_n = std::max(0.0, normal_force_n);
  const double told_n = std::max(force_n, kLeastForceN);
  const double at_told = std::pow(told_n / coefficient, 1.0 / law.exponent);
  const double x = force_n < kLeastForceN ? at_told * (force_n / kLeastForceN) : at_told;
  return {x, at_told / (law.exponent * told_n)};
}

}  // namespace hapticd::rt
