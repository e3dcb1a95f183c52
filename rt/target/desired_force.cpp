#include "rt/target/desired_force.h"

#include <algorithm>

namespace hapticd::rt {

DesiredForce desired_force_rigid(double reaction_force_n, double target_n_per_mm,
                                 double encoder_displacement_mm) noexcept {
  // Drawn back past the contact point the object is no longer deformed: nothing to render against.
  const double x = std::max(0.0, encoder_displacement_mm);
  return {reaction_force_n - target_n_per_mm * x, x};
}

DesiredForce desired_force_compensated(double reaction_force_n, double target_n_per_mm,
                                       double encoder_displacement_mm, double structural_n_per_mm,
                                       double share) noexcept {
  const double divisor =
      std::max(1.0 - share * target_n_per_mm / structural_n_per_mm, 1.0 - kMaxCompensableRatio);
  const double force = (reaction_force_n - target_n_per_mm * encoder_displacement_mm) / divisor;
  const double tip = encoder_displacement_mm - force / structural_n_per_mm;
  if (tip < 0.0) return {reaction_force_n, 0.0};
  return {force, tip};
}

}  // namespace hapticd::rt
