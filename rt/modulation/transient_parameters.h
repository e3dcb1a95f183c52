#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"

namespace hapticd::rt {

/// One decaying sinusoid of an impact in the acceleration of the grip, e^(-B t) sin(2π f t) once it has begun
/// (Okamura 2001; SmoothMode); at most gain times the speed of the impact.
struct TransientMode {
  double frequency_hz = 100.0;
  double decay_per_s = 80.0;  ///< B
  double gain_per_s = 15.0;   ///< largest acceleration over the speed
};

/// Device, sensor, tool and hand as two masses, as identified or assumed: motors, structure, grip. What the
/// rig knows (apparent mass, structural stiffness, tool) is taken from there.
struct GripDynamics {
  double mode_hz = 100.0;       ///< of the bare device, free; it divides its mass in two
  double amplifier_hz = 300.0;  ///< pole
  double grip_mass_g = 49.0;    ///< what moves with the tip except the tool: sensor and fingers
  double grip_stiffness_n_per_mm = 0.5;
  double grip_damping_n_s_per_mm = 4e-3;
  /// Stiffness of the object under the tip. 0: that of a linear target, else of the object's model at 1 N;
  /// without either it counts as soft.
  double object_stiffness_n_per_mm = 0.0;
};

/// What a contact's first moments are to feel like.
struct TransientParameters {
  static constexpr std::size_t kMaxModes = 3;
  std::vector<TransientMode> target;  ///< of the material that is to be felt, 1 … 3
  std::vector<TransientMode> real{};  ///< what the real object gives by itself, subtracted; 0 … 3
  double max_force_n = 3.0;
  GripDynamics grip{};
  /// False lets a transient begin as soon as contact is declared: for comparisons only, no scene can ask for
  /// it.
  bool needs_evidence = true;
};

/// Highest frequency that a loop of this rate renders: 300 Hz, and 0.15 of the rate, so that a period has
/// more than six ticks. 150 Hz at 1 kHz.
double highest_transient_hz(double rate_hz) noexcept;

/// Checks the ranges: frequency 10 Hz … highest_transient_hz(), decay 30 … 1000 1/s, gain 0 … 1000 1/s,
/// forces and masses; the error names the key, after `prefix`.
std::optional<hal::Error> check(const TransientParameters& transient, double rate_hz,
                                const std::string& prefix, const std::string& where);

}  // namespace hapticd::rt
