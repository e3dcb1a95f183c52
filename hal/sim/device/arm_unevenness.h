#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "hal/samples.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/device/axis_dynamics.h"

namespace hapticd::sim {

/// Mass and dry friction of an arm that differ by direction and pose: factors on the nominal values,
/// smooth, within 1 ± (anisotropy + pose). Coriolis terms (velocity effects of a pose-dependent mass) are
/// neglected: at 0.4 m/s they are below a hundredth of the friction.
class ArmUnevenness {
 public:
  explicit ArmUnevenness(const Conditions& conditions) noexcept;

  bool mass_varies() const noexcept { return mass_anisotropy_ > 0.0 || mass_pose_ > 0.0; }
  bool friction_varies() const noexcept { return friction_anisotropy_ > 0.0 || friction_pose_ > 0.0; }
  double mass_factor(std::size_t axis, const hal::Vector3& at_mm) const noexcept;
  double friction_factor(std::size_t axis, const hal::Vector3& at_mm) const noexcept;
  double smallest_mass_factor() const noexcept { return 1.0 - mass_anisotropy_ - mass_pose_; }
  double largest_mass_factor() const noexcept { return 1.0 + mass_anisotropy_ + mass_pose_; }

 private:
  double mass_anisotropy_;
  double mass_pose_;
  double friction_anisotropy_;
  double friction_pose_;
};

}  // namespace hapticd::sim
