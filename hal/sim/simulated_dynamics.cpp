#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "hal/sim/simulation.h"

namespace hapticd::sim {

namespace {

constexpr int kFieldSteps = 128;  // neighbours differ by 1 %, so that what lies between is right to 2e-5
constexpr int kMassSteps = 16;    // neighbours differ by 5 % at most: right to 1e-3 of what the mass changes

}  // namespace

AxisParameters axis_of(const DeviceModel& device, double tool_mass_kg, double hand_mass_kg,
                       double hand_stiffness_n_per_mm, double hand_damping_n_s_per_mm,
                       double arm_mass_factor) {
  AxisParameters axis;
  axis.motor_mass_kg = arm_mass_factor * device.motor_side_mass_kg();
  axis.tip_mass_kg =
      arm_mass_factor * device.tip_side_mass_kg() + device.sensor_mass_kg + tool_mass_kg + hand_mass_kg;
  axis.structural_stiffness_n_per_mm = device.structural_stiffness_n_per_mm;
  // Damping ratio of the bare device's free-free mode: c = 2 ζ μ ω.
  const double reduced_kg = device.motor_side_mass_kg() * device.tip_side_mass_kg() / device.apparent_mass_kg;
  axis.structural_damping_n_s_per_mm = 1e-3 * 2.0 * device.structural_damping * reduced_kg * 2.0 *
                                       std::numbers::pi * device.structural_mode_hz;
  axis.motor_viscosity_n_s_per_mm = device.viscous_friction_n_s_per_mm;
  axis.hand_stiffness_n_per_mm = hand_stiffness_n_per_mm;
  axis.hand_damping_n_s_per_mm = hand_damping_n_s_per_mm;
  return axis;
}

PreparedHand Simulation::prepare(const HandProgram& program) const {
  PreparedHand prepared;
  prepared.program = program;
  prepared.impedance = impedance_of(program);
  const HandImpedance& hand = prepared.impedance;

  const AxisParameters axis =
      axis_of(device_, tool_mass_kg_, hand.mass_kg, hand.stiffness_n_per_mm, hand.damping_n_s_per_mm);
  prepared.along = AxisDynamics(axis, step_s_);
  AxisParameters across = axis;
  across.hand_stiffness_n_per_mm = hand.lateral_stiffness_n_per_mm;
  across.hand_damping_n_s_per_mm = hand.lateral_damping_n_s_per_mm;
  prepared.across = AxisDynamics(across, step_s_);
  const bool structure_varies = !device_.structural_field.constant();
  if (structure_varies || unevenness_.mass_varies()) {
    const auto field = [&](double hand_stiffness_n_per_mm, double hand_damping_n_s_per_mm) {
      std::vector<AxisDynamics> all;
      const int masses = unevenness_.mass_varies() ? kMassSteps : 0;
      const double lightest = unevenness_.smallest_mass_factor();
      const double range = unevenness_.largest_mass_factor() - lightest;
      for (int m = 0; m <= masses; ++m) {
        AxisParameters parameters =
            axis_of(device_, tool_mass_kg_, hand.mass_kg, hand_stiffness_n_per_mm, hand_damping_n_s_per_mm,
                    masses > 0 ? lightest + range * m / masses : 1.0);
        const double home_n_per_mm = parameters.structural_stiffness_n_per_mm;
        for (int i = 0; i <= (structure_varies ? kFieldSteps : 0); ++i) {
          if (structure_varies) {
            const double log_compliance = std::numbers::ln2 * (2.0 * i / kFieldSteps - 1.0);
            parameters.structural_stiffness_n_per_mm = home_n_per_mm * std::exp(-log_compliance);
          }
          all.emplace_back(parameters, step_s_);
        }
      }
      return all;
    };
    prepared.along_field = field(hand.stiffness_n_per_mm, hand.damping_n_s_per_mm);
    prepared.across_field = field(hand.lateral_stiffness_n_per_mm, hand.lateral_damping_n_s_per_mm);
  }
  return prepared;
}

std::array<AxisDynamics, 3> Simulation::dynamics_at(const hal::Vector3& tip_mm) const noexcept {
  std::size_t structures = 1;
  std::size_t below = 0;
  double share = 0.0;
  if (!device_.structural_field.constant()) {
    structures = kFieldSteps + 1;
    const double log_compliance = device_.structural_field.log_compliance(tip_mm);
    const double at = 0.5 * kFieldSteps * (1.0 + log_compliance / std::numbers::ln2);
    below = static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, kFieldSteps - 1.0));
    share = at - static_cast<double>(below);
  }
  const auto of_mass = [&](const std::vector<AxisDynamics>& field, std::size_t mass) {
    const std::size_t first = mass * structures + below;
    return structures == 1 ? field[first] : AxisDynamics::between(field[first], field[first + 1], share);
  };
  if (!unevenness_.mass_varies()) {
    const AxisDynamics across = of_mass(hand_->across_field, 0);
    return {across, across, of_mass(hand_->along_field, 0)};
  }
  const double lightest = unevenness_.smallest_mass_factor();
  const double range = unevenness_.largest_mass_factor() - lightest;
  std::array<AxisDynamics, 3> all;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& field = axis == 2 ? hand_->along_field : hand_->across_field;
    const double at = kMassSteps * (unevenness_.mass_factor(axis, tip_mm) - lightest) / range;
    const auto mass = static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, kMassSteps - 1.0));
    all[axis] =
        AxisDynamics::between(of_mass(field, mass), of_mass(field, mass + 1), at - static_cast<double>(mass));
  }
  return all;
}

}  // namespace hapticd::sim
