#pragma once

#include "rt/deformation/contact_law.h"

namespace hapticd::rt {

/// f = K x^m + B x^m ẋ   (4.22)
struct HuntCrossleyParameters {
  double stiffness_n_per_mm_m = 1.0;   ///< K, N/mm^m
  double damping_n_s_per_mm_m1 = 0.0;  ///< B, N·s/mm^(m+1)
  double exponent = 1.0;               ///< m, 1 … 3
};

/// Force by (4.22); never below zero: an object does not pull.
double hunt_crossley_force_n(const HuntCrossleyParameters& law, double displacement_mm,
                             double rate_mm_per_s) noexcept;

/// Displacement x = (f/(K + Bẋ))^(1/m) (4.23), for f > 0; zero otherwise. Withdrawal faster than 0.8 K/B,
/// where the law has almost no force left and the inverse no bound, counts as 0.8 K/B. The sensitivity x/(m
/// f) grows without bound as f → 0 for m > 1; below 1 mN it is reported as at 1 mN.
LawEstimate hunt_crossley_displacement(const HuntCrossleyParameters& law, double normal_force_n,
                                       double rate_mm_per_s) noexcept;

}  // namespace hapticd::rt
