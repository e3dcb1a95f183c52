#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"
#include "hal/sim/device/arm.h"

namespace hapticd::sim {

/// How the structure's compliance varies over the workspace, relative to that at the tip's home (0, 0, 0):
///   c(p) / c_0 = exp(g·p + p·H p),  held within a factor of two,
/// H's upper triangle as (xx, yy, zz, xy, xz, yz). Alike in all directions.
struct StructuralField {
  hal::Vector3 gradient_per_mm;
  std::array<double, 6> curvature_per_mm2{};

  bool constant() const noexcept;
  /// ln(c(p)/c_0), within ± ln 2.
  double log_compliance(const hal::Vector3& position_mm) const noexcept;
};

/// A force-feedback device as two masses joined by its structure: motors and encoders on one side, tip,
/// sensor and hand on the other. Along any axis alike. Sources are named in device_model.cpp.
struct DeviceModel {
  std::string name;
  double max_force_n = 0.0;
  double max_continuous_force_n = 0.0;
  double apparent_mass_kg = 0.0;  ///< bare device at the tip, both sides together
  double structural_stiffness_n_per_mm = 0.0;
  StructuralField structural_field{};  ///< constant in the presets
  double structural_mode_hz =
      0.0;  ///< uncertain: free-free mode of the bare device; it parts the mass in two
  double structural_damping = 0.0;  ///< uncertain: damping ratio of that mode
  double coulomb_friction_n = 0.0;
  double viscous_friction_n_s_per_mm = 0.0;
  double amplifier_pole_hz = 0.0;  ///< uncertain
  int dac_bits = 12;               ///< uncertain
  double encoder_resolution_mm = 0.0;
  double command_latency_s = 0.001;  ///< one tick of a 1 kHz loop
  double gimbal_noise_rad = 2e-4;    ///< standard deviation of the orientation reading
  Arm arm{};                         ///< uncertain: that of the 1.5
  double sensor_mass_kg = 0.009;     ///< Nano17, on the tip side

  double motor_side_mass_kg() const;
  double tip_side_mass_kg() const;  ///< bare, without sensor, tool and hand
  double force_step_n() const;      ///< of the DAC
  hal::DeviceInfo info() const;
  std::vector<hal::UncertainParameter> uncertain() const;
};

std::optional<DeviceModel> device_preset(const std::string& name);
std::vector<std::string> device_preset_names();

}  // namespace hapticd::sim
