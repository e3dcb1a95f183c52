#pragma once

#include <array>
#include <cstdint>

#include "hal/phantom/kinematics.h"
#include "hal/phantom/phantom_config.h"

namespace hapticd::phantom {

/// Currents of the three motors, A, positive where the torque turns the joint on.
using Currents = std::array<double, 3>;
using Volts = std::array<double, 3>;

/// Between joints and board: cable transmission, encoders, motors, amplifiers. One way drives the device, the
/// other checks it.
class Drive {
 public:
  explicit Drive(const PhantomConfig& config) noexcept;

  /// Turn of the joints since the counts were at `zero`.
  JointAngles turn_rad(const std::array<std::int64_t, 3>& counts,
                       const std::array<std::int64_t, 3>& zero) const noexcept;
  const std::array<double, 3>& rad_per_count() const noexcept { return rad_per_count_; }

  Currents currents_for(const std::array<double, 3>& joint_torque_n_mm) const noexcept;
  Volts volts_for(const Currents& current_a) const noexcept;

  Currents currents_of(const Volts& volts) const noexcept;
  std::array<double, 3> joint_torques_of_n_mm(const Currents& current_a) const noexcept;

 private:
  std::array<double, 3> rad_per_count_{};  ///< signed
  std::array<double, 3> n_mm_per_a_{};     ///< at the joint
  std::array<double, 3> signed_gain_a_per_v_{};
};

/// Volts that make a force of the device on the tip, without any limit.
Volts volts_for_force(const ArmGeometry& arm, const Drive& drive, const JointAngles& q,
                      const hal::Vector3& force_n) noexcept;
/// What those volts make; see force_of_n() for singular poses.
hal::Vector3 force_of_volts_n(const ArmGeometry& arm, const Drive& drive, const JointAngles& q,
                              const Volts& volts) noexcept;

/// How far one count of any encoder moves the tip at most, mm.
double tip_resolution_mm(const PhantomConfig& config, const JointAngles& q) noexcept;

/// The force along x, y, z that the joint currents can hold there, each alone, N.
std::array<double, 3> axis_forces_n(const PhantomConfig& config, const JointAngles& q,
                                    const Currents& current_a) noexcept;

/// The force that the currents can hold there whatever its direction, N.
double force_in_any_direction_n(const PhantomConfig& config, const JointAngles& q,
                                const Currents& current_a) noexcept;
/// The same with the drive of that configuration at hand, in a tick.
double force_in_any_direction_n(const PhantomConfig& config, const Drive& drive, const JointAngles& q,
                                const Currents& current_a) noexcept;

}  // namespace hapticd::phantom
