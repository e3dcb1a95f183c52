#pragma once

#include <cmath>
#include <numbers>

#include "hal/samples.h"

namespace hapticd::rt {

/// How far the device's structure is bent, so that the encoders miss it: the tip is at p = p_s - f_d/k_s, f_d
/// the force of the device on the tip ((4.25) with the sign that (4.26) demands).
///
/// Put in at once, last tick's command closes a loop of gain k~/k_s within a tick, while the motors take
/// several ticks to bend the structure that much. Through a first-order lag of a few hertz the deflection is
/// right where it matters, in pressing and holding, and no part of the fast loop; without a cut-off (0) it
/// follows at once, as published.
class StructuralDeflection {
 public:
  /// A stiffness of 0 stands for a rigid device.
  StructuralDeflection(double stiffness_n_per_mm, double cutoff_hz, double rate_hz) noexcept
      : compliance_mm_per_n_(stiffness_n_per_mm > 0.0 ? 1.0 / stiffness_n_per_mm : 0.0),
        share_(cutoff_hz > 0.0 ? 1.0 - std::exp(-2.0 * std::numbers::pi * cutoff_hz / rate_hz) : 1.0) {}

  /// Takes the force the device was given last; returns p_s - p.
  const hal::Vector3& update(const hal::Vector3& device_force_n) noexcept {
    deflection_mm_ = deflection_mm_ + (device_force_n * compliance_mm_per_n_ - deflection_mm_) * share_;
    return deflection_mm_;
  }
  void reset() noexcept { deflection_mm_ = {}; }

 private:
  double compliance_mm_per_n_;
  double share_;
  hal::Vector3 deflection_mm_;
};

}  // namespace hapticd::rt
