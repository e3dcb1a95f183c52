#pragma once

#include <array>
#include <cstdint>

#include "hal/phantom/kinematics.h"
#include "hal/phantom/phantom_config.h"

namespace hapticd::phantom {

/// Currents of the three motors, A, positive if the torque turns the joint forward.
using Currents = std::array<double, 3>;
using Volts = std::array<double, 3>;

/// Cable transmission, encoders, motors and amplifiers between joints and board. Torque → volts drives the
/// device.
class Drive {
 public:
  explicit Drive(const PhantomConfig& config) noexcept;

  /// Rotation of the joints since the counts were `zero`, rad.
  JointAngles turn_rad(const std::array<std::int64_t, 3>& counts,
                       const std::array<std::int64_t, 3>& zero) const noexcept;
  const std::array<double, 3>& rad_per_count() const noexcept { return rad_per_count_; }

  Currents currents_for(const std::array<double, 3>& joint_torque_n_mm) const noexcept;
  Volts volts_for(const Currents& current_a) const noexcept;

  std::array<double, 3> joint_torques_of_n_mm(const Currents& current_a) const noexcept;

 private:
  std::array<double, 3> rad_per_count_{};  ///< signed
  std::array<double, 3> n_mm_per_a_{};     ///< at the joint
  std::array<double, 3> signed_gain_a_per_v_{};
};

/// Largest motion of the tip for one count of any encoder, mm.
double tip_resolution_mm(const PhantomConfig& config, const JointAngles& q) noexcept;

/// The force that the currents can hold in this pose in every direction, N.
double force_in_any_direction_n(const PhantomConfig& config, const JointAngles& q,
                                const Currents& current_a) noexcept;
/// Force with an existing drive of that configuration; for the tick.
double force_in_any_direction_n(const PhantomConfig& config, const Drive& drive, const JointAngles& q,
                                const Currents& current_a) noexcept;

}  // namespace hapticd::phantom
