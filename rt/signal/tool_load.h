#pragma once

#include "hal/samples.h"
#include "rt/signal/tool_compensation.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Weight and inertia of the tool in any orientation, (4.5)-(4.8).
///
/// The sensor, biased with the tool hanging still, reads in tool coordinates
///   f_s = Tᵀ (f_r + m (g - a)) - m g_0,
/// with T the tool's rotation, g gravity in the rig frame and g_0 gravity as the tool saw it when the sensor
/// was biased (4.6). All in rig coordinates below; a 1° error of orientation costs m G · 0.017 (2 mN for
/// 12.6 g).
class ToolLoad {
 public:
  static constexpr double kGravityMmPerS2 = 9807.0;  // (4.6)

  /// `gravity_at_bias`: unit vector, tool frame.
  ToolLoad(double mass_g, const hal::Vector3& gravity_at_bias) noexcept
      : mass_g_(mass_g),
        weight_n_{0.0, 0.0, -inertial_force_n(mass_g, kGravityMmPerS2)},
        weight_at_bias_n_(gravity_at_bias * inertial_force_n(mass_g, kGravityMmPerS2)) {}

  /// f_r - m a, rig frame: what is left when weight is taken off ((4.5) without its inertia).
  hal::Vector3 without_weight_n(const hal::RigSample& sample) const noexcept {
    return rotated(unit(sample.tip_orientation), sample.sensor_force_n + weight_at_bias_n_) - weight_n_;
  }
  /// m a (4.7).
  hal::Vector3 inertia_n(const hal::Vector3& acceleration_mm_per_s2) const noexcept {
    return acceleration_mm_per_s2 * inertial_force_n(mass_g_, 1.0);
  }

 private:
  double mass_g_;
  hal::Vector3 weight_n_;
  hal::Vector3 weight_at_bias_n_;
};

}  // namespace hapticd::rt
