#pragma once

#include <cmath>

namespace hapticd::turntable {

/// Duration of a motion from rest to rest with a trapezoidal (or, when short, triangular) profile of speed.
inline double trapezoid_duration_s(double distance_deg, double speed_deg_per_s,
                                   double acceleration_deg_per_s2) noexcept {
  const double distance = std::abs(distance_deg);
  const double ramp_deg = speed_deg_per_s * speed_deg_per_s / acceleration_deg_per_s2;  // both ramps together
  if (distance <= ramp_deg) return 2.0 * std::sqrt(distance / acceleration_deg_per_s2);
  return distance / speed_deg_per_s + speed_deg_per_s / acceleration_deg_per_s2;
}

}  // namespace hapticd::turntable
