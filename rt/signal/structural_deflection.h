#pragma once

#include <numbers>

#include "hal/samples.h"
#include "rt/signal/decay.h"

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
  /// Makes a deflection; a stiffness of 0 means a rigid device.
  StructuralDeflection(double stiffness_n_per_mm, double cutoff_hz, double rate_hz) noexcept
      : compliance_mm_per_n_(stiffness_n_per_mm > 0.0 ? 1.0 / stiffness_n_per_mm : 0.0),
        lags_(cutoff_hz > 0.0),
        decay_(lags_ ? Decay(1.0 / (2.0 * std::numbers::pi * cutoff_hz), rate_hz) : Decay()) {}

  /// Takes the force the device was given last, `periods` of the loop ago; returns p_s - p.
  const hal::Vector3& update(const hal::Vector3& device_force_n, double periods = 1.0) noexcept {
    const double share = lags_ ? 1.0 - decay_.over(periods) : 1.0;
    deflection_mm_ = deflection_mm_ + (device_force_n * compliance_mm_per_n_ - deflection_mm_) * share;
    return deflection_mm_;
  }
  /// Sets the stiffness at the tip's present place, for a device whose stiffness varies; > 0.
  void set_stiffness_n_per_mm(double stiffness_n_per_mm) noexcept {
    compliance_mm_per_n_ = 1.0 / stiffness_n_per_mm;
  }
  void reset() noexcept { deflection_mm_ = {}; }

 private:
  double compliance_mm_per_n_;
  bool lags_;
  Decay decay_;
  hal::Vector3 deflection_mm_;
};

}  // namespace hapticd::rt
