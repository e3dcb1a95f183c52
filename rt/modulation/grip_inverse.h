#pragma once

#include <complex>

#include "rt/modulation/transient_parameters.h"

namespace hapticd::rt {

/// What moves when the motors push: two masses joined by the structure, the hand's spring and damper on the
/// tip, the amplifier's pole before the motors. The structure's own damping is left out: the inverse is then
/// a polynomial over s², and a smooth beginning of five orders leaves no jump in the command. SI units.
struct GripPlant {
  double motor_mass_kg = 0.0;
  double tip_mass_kg = 0.0;
  double structure_n_per_m = 0.0;
  double grip_n_per_m = 0.0;  ///< of hand and object together
  double grip_n_s_per_m = 0.0;
  double amplifier_rad_per_s = 0.0;

  double mass_kg() const noexcept { return motor_mass_kg + tip_mass_kg; }
};

/// `object_n_per_mm`: what the tip touches, as it is rendered.
GripPlant grip_plant(const GripDynamics& grip, double apparent_mass_g, double structure_n_per_mm,
                     double tool_mass_g, double object_n_per_mm);

/// Command over acceleration of the tip at the complex frequency s: N s²/m.
std::complex<double> command_per_acceleration(const GripPlant& plant, std::complex<double> s);
/// Velocity of the motors over that acceleration: s.
std::complex<double> motor_velocity_per_acceleration(const GripPlant& plant, std::complex<double> s);

}  // namespace hapticd::rt
