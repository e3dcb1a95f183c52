#include "hal/phantom/drive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace hapticd::phantom {

Drive::Drive(const PhantomConfig& config) noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    rad_per_count_[i] = config.encoder_sign[i] * 2.0 * std::numbers::pi /
                        (config.encoder_counts_per_turn[i] * config.transmission[i]);
    n_mm_per_a_[i] = config.torque_constant_n_mm_per_a[i] * config.transmission[i];
    signed_gain_a_per_v_[i] = config.motor_sign[i] * config.amplifier_gain_a_per_v[i];
  }
}

JointAngles Drive::turn_rad(const std::array<std::int64_t, 3>& counts,
                            const std::array<std::int64_t, 3>& zero) const noexcept {
  JointAngles turn{};
  for (std::size_t i = 0; i < 3; ++i) turn[i] = static_cast<double>(counts[i] - zero[i]) * rad_per_count_[i];
  return turn;
}

Currents Drive::currents_for(const std::array<double, 3>& joint_torque_n_mm) const noexcept {
  Currents current{};
  for (std::size_t i = 0; i < 3; ++i) current[i] = joint_torque_n_mm[i] / n_mm_per_a_[i];
  return current;
}

Volts Drive::volts_for(const Currents& current_a) const noexcept {
  Volts volts{};
  for (std::size_t i = 0; i < 3; ++i) volts[i] = current_a[i] / signed_gain_a_per_v_[i];
  return volts;
}

std::array<double, 3> Drive::joint_torques_of_n_mm(const Currents& current_a) const noexcept {
  std::array<double, 3> torque{};
  for (std::size_t i = 0; i < 3; ++i) torque[i] = current_a[i] * n_mm_per_a_[i];
  return torque;
}

double tip_resolution_mm(const PhantomConfig& config, const JointAngles& q) noexcept {
  const Jacobian j = jacobian(config.arm, q);
  const Drive drive(config);
  double coarsest_mm = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    coarsest_mm =
        std::max(coarsest_mm, std::hypot(j[0][i], j[1][i], j[2][i]) * std::abs(drive.rad_per_count()[i]));
  }
  return coarsest_mm;
}

double force_in_any_direction_n(const PhantomConfig& config, const JointAngles& q,
                                const Currents& current_a) noexcept {
  return force_in_any_direction_n(config, Drive(config), q, current_a);
}

double force_in_any_direction_n(const PhantomConfig& config, const Drive& drive, const JointAngles& q,
                                const Currents& current_a) noexcept {
  const Jacobian j = jacobian(config.arm, q);
  const std::array<double, 3> torque_n_mm = drive.joint_torques_of_n_mm(current_a);
  double force_n = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const double lever_mm = std::hypot(j[0][i], j[1][i], j[2][i]);
    if (lever_mm > 0.0) force_n = std::min(force_n, std::abs(torque_n_mm[i]) / lever_mm);
  }
  return force_n;
}

}  // namespace hapticd::phantom
