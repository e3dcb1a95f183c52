#include "hal/sim/object/reduced_function.h"

#include <cmath>

namespace hapticd::sim {

ReducedFunction::Value ReducedFunction::at(double depth_mm, double angle_rad) const noexcept {
  Value all;
  if (depth_mm <= 0.0) return all;
  const bool local = scale_rad > 0.0;
  const double t = local ? angle_rad * angle_rad / (scale_rad * scale_rad)
                         : 2.0 * std::sin(angle_rad) * std::sin(angle_rad);
  const double t_slope = local ? 2.0 * angle_rad / (scale_rad * scale_rad) : 2.0 * std::sin(2.0 * angle_rad);
  const double e = local ? std::exp(-t) : 1.0;
  const double beyond_mm = depth_mm > last_depth_mm ? depth_mm - last_depth_mm : 0.0;
  const double d = depth_mm - beyond_mm;
  for (std::size_t k = 0; k < kPowers; ++k) {
    const double p = powers[k];
    double power = std::pow(d, p);
    double slope = p * power / d;
    const double bend = (p - 1.0) * slope / d;
    power += beyond_mm * (slope + 0.5 * beyond_mm * bend);
    slope += beyond_mm * bend;
    double sum = 0.0;
    double sum_slope = 0.0;
    for (std::size_t m = kTerms; m-- > 0;) {
      sum_slope = sum_slope * t + sum;
      sum = sum * t + factors[k][m];
    }
    const double angular = e * sum;
    const double angular_slope = t_slope * e * (sum_slope - (local ? sum : 0.0));
    all.value += power * angular;
    all.by_depth += slope * angular;
    all.by_depth_twice += bend * angular;
    all.by_angle += power * angular_slope;
    all.by_depth_and_angle += slope * angular_slope;
  }
  return all;
}

}  // namespace hapticd::sim
