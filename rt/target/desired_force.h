#pragma once

namespace hapticd::rt {

/// Largest target, as a fraction of the structural stiffness, that the compensation may serve. At 1 no finite
/// motor force gives the target (the structure alone yields that much); at 0.8 measurement errors count
/// five-fold.
inline constexpr double kMaxCompensableRatio = 0.8;

/// What (3.3) yields at one tick.
struct DesiredForce {
  double force_n = 0.0;  ///< f~_d, positive into the object
  double displacement_mm =
      0.0;  ///< x_r it was computed with: the tip's if compensated, the encoders' otherwise
};

/// f~_d = f_r - k~ x (3.3) on a device taken as rigid: `encoder_displacement_mm` is the displacement.
DesiredForce desired_force_rigid(double reaction_force_n, double target_n_per_mm,
                                 double encoder_displacement_mm) noexcept;

/// (3.3) on a device that bends: the tip is at x = x_s - f_d / k_s ((4.25) with the sign that (4.26)
/// demands). Putting last tick's command in for f_d would add a pole at 1 - Kp (1 - k~/k_s) to the
/// controller; solving for the present f~_d instead,  f~_d = (f_r - k~ x_s) / (1 - k~/k_s),  adds none.
/// Requires target < structural stiffness; beyond kMaxCompensableRatio of it the divisor is held, which
/// bounds the gain. `share`: of k~/k_s in the divisor; 0 gives the force of (3.3) on a rigid device.
DesiredForce desired_force_compensated(double reaction_force_n, double target_n_per_mm,
                                       double encoder_displacement_mm, double structural_n_per_mm,
                                       double share = 1.0) noexcept;

}  // namespace hapticd::rt
