#include "rt/modulation/grip_inverse.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::rt {

namespace {

constexpr double kMmPerM = 1e3;

/// Impedance of hand, object and tip's mass: force over displacement of the tip.
std::complex<double> tip_impedance(const GripPlant& p, std::complex<double> s) {
  return p.tip_mass_kg * s * s + p.grip_n_s_per_m * s + p.grip_n_per_m;
}

}  // namespace

GripPlant grip_plant(const GripDynamics& grip, double apparent_mass_g, double structure_n_per_mm,
                     double tool_mass_g, double object_n_per_mm) {
  GripPlant plant;
  const double apparent_kg = 1e-3 * apparent_mass_g;
  const double omega = 2.0 * std::numbers::pi * grip.mode_hz;
  plant.structure_n_per_m = kMmPerM * structure_n_per_mm;
  // Two free masses on a spring swing at ω² = k/μ, μ = m1 m2 / (m1 + m2).
  const double reduced_kg = std::min(plant.structure_n_per_m / (omega * omega), 0.25 * apparent_kg);
  const double tip_kg = 0.5 * apparent_kg * (1.0 - std::sqrt(1.0 - 4.0 * reduced_kg / apparent_kg));
  plant.motor_mass_kg = apparent_kg - tip_kg;
  plant.tip_mass_kg = tip_kg + 1e-3 * (tool_mass_g + grip.grip_mass_g);
  plant.grip_n_per_m = kMmPerM * (grip.grip_stiffness_n_per_mm + object_n_per_mm);
  plant.grip_n_s_per_m = kMmPerM * grip.grip_damping_n_s_per_mm;
  plant.amplifier_rad_per_s = 2.0 * std::numbers::pi * grip.amplifier_hz;
  return plant;
}

std::complex<double> command_per_acceleration(const GripPlant& p, std::complex<double> s) {
  const auto z = tip_impedance(p, s);
  const double d = p.structure_n_per_m;
  const auto motor = (z + d) / d;  // displacement of the motors over that of the tip
  const auto force = (p.motor_mass_kg * s * s + d) * motor - d;
  return force * (1.0 + s / p.amplifier_rad_per_s) / (s * s);
}

std::complex<double> motor_velocity_per_acceleration(const GripPlant& p, std::complex<double> s) {
  return (tip_impedance(p, s) + p.structure_n_per_m) / (p.structure_n_per_m * s);
}

}  // namespace hapticd::rt
