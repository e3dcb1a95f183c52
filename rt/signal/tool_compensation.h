#pragma once

namespace hapticd::rt {

/// f_i = m a (3.5). The one place where mass × acceleration meets millimetres: g · mm/s² = 1e-6 N.
constexpr double inertial_force_n(double mass_g, double acceleration_mm_per_s2) noexcept {
  return 1e-6 * mass_g * acceleration_mm_per_s2;
}

/// Reaction of the object from the sensor reading, both along the press axis, positive when the object pushes
/// back. f_r = f_s - f_i (3.4): accelerating the tool into the object makes the sensor read more than the
/// object gives. In 1D the tool keeps its orientation, so gravity went into the sensor's bias.
constexpr double reaction_force_n(double sensor_force_n, double tool_mass_g,
                                  double acceleration_mm_per_s2) noexcept {
  return sensor_force_n - inertial_force_n(tool_mass_g, acceleration_mm_per_s2);
}

}  // namespace hapticd::rt
