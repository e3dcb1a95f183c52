#pragma once

#include <array>
#include <cstdint>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/device/arm.h"

namespace hapticd::sim {

/// How an arm really is: other lengths and angles than its drawing says, links that bend under their weight,
/// a gimbal with play. What the device reports follows from its drawing all the same. Drawn by the seed from
/// normal distributions that are cut at two standard deviations.
class HiddenArm {
 public:
  HiddenArm(const Arm& drawing, const Conditions& conditions, std::uint64_t seed) noexcept;

  bool exact() const noexcept { return exact_; }
  /// The angles that the device counts with its tip and tool there. `step_rad`: of the joints' encoders.
  /// Moves the gimbal's play along.
  hal::DeviceAngles counted(const hal::Vector3& tip_mm, const hal::Quaternion& orientation,
                            double step_rad) noexcept;
  /// Position that the device computes from its angles.
  hal::Vector3 reported_tip_mm(const hal::DeviceAngles& angles) const noexcept;
  hal::Quaternion reported_orientation(const hal::DeviceAngles& angles) const noexcept;

  const Arm& arm() const noexcept { return arm_; }

 private:
  Arm drawing_;
  Arm arm_;
  std::array<double, 3> joint_gain_{1.0, 1.0, 1.0};
  std::array<double, 3> joint_offset_rad_{};
  std::array<double, 3> gimbal_gain_{1.0, 1.0, 1.0};
  std::array<double, 3> gimbal_offset_rad_{};
  std::array<double, 3> ripple_phase_rad_{};
  double ripple_rad_ = 0.0;
  double half_play_rad_ = 0.0;
  double sag_mm_ = 0.0;
  std::array<double, 3> held_rad_{};  ///< readings of the potentiometers, with their play
  bool holds_ = false;
  bool exact_ = true;
};

}  // namespace hapticd::sim
