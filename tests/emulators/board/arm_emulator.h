#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"

namespace hapticd::emulators {

/// A desktop arm's linkage, motors and encoders as someone else would describe them. Defaults: a Premium
/// 1.5.
struct ArmDescription {
  double upper_arm_mm = 215.0;
  double forearm_mm = 170.0;
  std::array<double, 3> gear{13.3, 11.2, 11.2};
  std::array<double, 3> counts_per_motor_turn{4096.0, 4096.0, 4096.0};
  std::array<double, 3> motor_n_mm_per_a{23.4, 23.4, 23.4};
  std::array<double, 3> amplifier_a_per_v{0.6, 0.6, 0.6};
  hal::Vector3 shoulder_mm{};  ///< in the rig's frame
};

/// Statics of that arm, by geometry (law of cosines) and virtual work (differences), not by formulas for a
/// Jacobian.
class ArmEmulator {
 public:
  explicit ArmEmulator(const ArmDescription& description) : arm_(description) {}

  /// Turn of the base, elevation of the upper arm, swing of the forearm from hanging down; rad.
  std::array<double, 3> joints(const hal::Vector3& tip_mm) const;
  hal::Vector3 tip_mm(const std::array<double, 3>& joints_rad) const;
  /// Counts since the pose with the upper arm level and the forearm hanging.
  std::array<std::int64_t, 3> counts(const std::array<double, 3>& joints_rad) const;
  /// Angles of a gimbal at the forearm's end that give the tool an orientation: about the forearm's own up,
  /// then across, then along the stylus, upright with the forearm hanging. rad.
  std::array<double, 3> gimbal(const std::array<double, 3>& joints_rad,
                               const hal::Quaternion& orientation) const;
  /// What volts at the amplifiers make at the tip.
  hal::Vector3 tip_force_n(const std::array<double, 3>& joints_rad, const std::array<double, 3>& volts) const;

 private:
  ArmDescription arm_;
};

}  // namespace hapticd::emulators
