#include "hal/sim/device/device_model.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::sim {

namespace {

// Force limits, apparent mass, friction of the 1.5, resolution, structural stiffness: SensAble data sheets.
// 2.537 N/mm: measured on the high-force device (D§4.6). Back-drive friction of the 1.0: 0.06 N, from memory
// of the literature. Viscosity: 0.005 N·s/m, what Abbott and Okamura's wall bound implies for the 1.0; the
// high-force device is given four times as much for its larger motors (assumed). The rest is uncertain and
// reported.
const std::vector<DeviceModel>& presets() {
  static const std::vector<DeviceModel> all = [] {
    DeviceModel p10;
    p10.name = "phantom_1_0";
    p10.max_force_n = 8.5;
    p10.max_continuous_force_n = 1.4;
    p10.apparent_mass_kg = 0.075;
    p10.structural_stiffness_n_per_mm = 3.5;
    p10.structural_mode_hz = 100.0;
    p10.structural_damping = 0.05;
    p10.coulomb_friction_n = 0.06;
    p10.viscous_friction_n_s_per_mm = 5e-6;
    p10.amplifier_pole_hz = 300.0;
    p10.encoder_resolution_mm = 0.03;

    DeviceModel high_force = p10;
    high_force.name = "phantom_1_5_high_force";
    high_force.max_force_n = 37.5;
    high_force.max_continuous_force_n = 6.2;
    high_force.apparent_mass_kg = 0.150;
    high_force.structural_stiffness_n_per_mm = 2.537;
    high_force.coulomb_friction_n = 0.2;
    high_force.viscous_friction_n_s_per_mm = 2e-5;
    high_force.encoder_resolution_mm = 0.007;
    return std::vector<DeviceModel>{p10, high_force};
  }();
  return all;
}

}  // namespace

bool StructuralField::constant() const noexcept {
  if (dot(gradient_per_mm, gradient_per_mm) != 0.0) return false;
  return std::all_of(curvature_per_mm2.begin(), curvature_per_mm2.end(), [](double h) { return h == 0.0; });
}

double StructuralField::log_compliance(const hal::Vector3& p) const noexcept {
  const auto& h = curvature_per_mm2;
  const double exponent = dot(gradient_per_mm, p) + h[0] * p.x * p.x + h[1] * p.y * p.y + h[2] * p.z * p.z +
                          2.0 * (h[3] * p.x * p.y + h[4] * p.x * p.z + h[5] * p.y * p.z);
  return std::clamp(exponent, -std::numbers::ln2, std::numbers::ln2);
}

// Two free masses on a spring swing at ω² = k/μ with μ = m1 m2 / (m1 + m2); with the sum known this is a
// quadratic.
double DeviceModel::tip_side_mass_kg() const {
  const double omega = 2.0 * std::numbers::pi * structural_mode_hz;
  const double reduced_kg = 1e3 * structural_stiffness_n_per_mm / (omega * omega);
  const double root = std::sqrt(std::max(0.0, 1.0 - 4.0 * reduced_kg / apparent_mass_kg));
  return 0.5 * apparent_mass_kg * (1.0 - root);
}

double DeviceModel::motor_side_mass_kg() const {
  return apparent_mass_kg - tip_side_mass_kg();
}

double DeviceModel::force_step_n() const {
  return 2.0 * max_force_n / std::exp2(dac_bits);
}

hal::DeviceInfo DeviceModel::info() const {
  return {name,
          max_force_n,
          max_continuous_force_n,
          encoder_resolution_mm,
          structural_stiffness_n_per_mm,
          1e3 * apparent_mass_kg,
          coulomb_friction_n,
          structural_mode_hz};
}

std::vector<hal::UncertainParameter> DeviceModel::uncertain() const {
  return {
      {"structural_mode_hz", structural_mode_hz, "Hz", "assumed; published values go from 60 to 220 Hz"},
      {"structural_damping", structural_damping, "1", "assumed: lightly damped metal structure"},
      {"amplifier_pole_hz", amplifier_pole_hz, "Hz",
       "assumed; the motor's own electrical pole is near 1400 Hz"},
      {"dac_bits", static_cast<double>(dac_bits), "bit", "assumed"},
      {"coulomb_friction_n", coulomb_friction_n, "N",
       "back-drive friction of the data sheet or of the literature"},
      {"viscous_friction_n_s_per_mm", viscous_friction_n_s_per_mm, "N·s/mm",
       "implied by published virtual-wall bounds"},
      {"first_link_mm", arm.first_link_mm, "mm", "published for the Premium 1.5; assumed for others"},
      {"second_link_mm", arm.second_link_mm, "mm", "published for the Premium 1.5; assumed for others"},
  };
}

std::optional<DeviceModel> device_preset(const std::string& name) {
  for (const DeviceModel& model : presets()) {
    if (model.name == name) return model;
  }
  return std::nullopt;
}

std::vector<std::string> device_preset_names() {
  std::vector<std::string> names;
  for (const DeviceModel& model : presets()) names.push_back(model.name);
  return names;
}

}  // namespace hapticd::sim
