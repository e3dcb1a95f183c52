#pragma once

#include <array>

namespace hapticd::sim {

/// One axis of device and hand: motor side and tip side joined by the structure, the hand's spring and damper
/// on the tip side. Masses in kg, stiffness N/mm, damping N·s/mm.
struct AxisParameters {
  double motor_mass_kg = 0.0;
  double tip_mass_kg = 0.0;  ///< tip, sensor, tool and the part of the hand that moves with them
  double structural_stiffness_n_per_mm = 0.0;
  double structural_damping_n_s_per_mm = 0.0;
  double motor_viscosity_n_s_per_mm = 0.0;
  double hand_stiffness_n_per_mm = 0.0;
  double hand_damping_n_s_per_mm = 0.0;
};

/// State of one axis.
struct AxisState {
  double motor_mm = 0.0;
  double motor_mm_per_s = 0.0;
  double tip_mm = 0.0;
  double tip_mm_per_s = 0.0;
};

/// Exact solution over one step of constant forces on both sides (matrix exponential, computed once): no
/// integration error and no artificial damping of the structural mode, whatever the step.
class AxisDynamics {
 public:
  AxisDynamics() = default;
  AxisDynamics(const AxisParameters& parameters, double step_s);

  /// Advances by a step. The hand's pull towards its intended position counts as a force on the tip.
  AxisState advance(const AxisState& s, double motor_force_n, double tip_force_n) const noexcept {
    const std::array<double, 6> in{s.motor_mm,     s.motor_mm_per_s, s.tip_mm,
                                   s.tip_mm_per_s, motor_force_n,    tip_force_n};
    std::array<double, 4> out{};
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t column = 0; column < 6; ++column) out[row] += map_[row][column] * in[column];
    }
    return {out[0], out[1], out[2], out[3]};
  }

  /// Dynamics between two that differ little: `share` 0 is a, 1 is b.
  static AxisDynamics between(const AxisDynamics& a, const AxisDynamics& b, double share) noexcept {
    AxisDynamics mixed;
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t column = 0; column < 6; ++column) {
        mixed.map_[row][column] = a.map_[row][column] + share * (b.map_[row][column] - a.map_[row][column]);
      }
    }
    return mixed;
  }

  /// Change of the state per newton that acts throughout the step.
  double motor_velocity_per_motor_force() const noexcept { return map_[1][4]; }
  double tip_position_per_tip_force() const noexcept { return map_[2][5]; }
  void add_motor_force(AxisState& s, double force_n) const noexcept { add(s, 4, force_n); }
  void add_tip_force(AxisState& s, double force_n) const noexcept { add(s, 5, force_n); }

 private:
  void add(AxisState& s, std::size_t input, double force_n) const noexcept {
    s.motor_mm += map_[0][input] * force_n;
    s.motor_mm_per_s += map_[1][input] * force_n;
    s.tip_mm += map_[2][input] * force_n;
    s.tip_mm_per_s += map_[3][input] * force_n;
  }

  /// Rows: state after the step; columns: state before, motor force, tip force.
  std::array<std::array<double, 6>, 4> map_{};
};

}  // namespace hapticd::sim
