#pragma once

#include <algorithm>

#include "rt/signal/vector.h"

namespace hapticd::rt {

/// Observer and controller of the energy at the hand (time-domain passivity, Hannaford and Ryu), for what
/// object and device together give the hand, f_r + f_d. The device's own port is active by design when it
/// softens an object; the hand's must not be: since the contact began
///   E_h = -Σ (f_r + f_d)·Δp ≥ -ε,
/// exact for forces held over a tick. What is missing is taken from the motion by a damping α on the device
/// force, α = deficit/(v² T), bounded where a sampled damper stays stable, with v² floored.
class HandPortPassivity {
 public:
  static constexpr double kToleranceMj = 0.5;         // ε
  static constexpr double kMaxDampingNsPerMm = 0.01;  // 0.1 kg over ten periods
  static constexpr double kMinSpeedMmPerS = 2.0;

  explicit HandPortPassivity(double rate_hz) noexcept : period_s_(1.0 / rate_hz) {}

  void begin() noexcept { energy_mj_ = damping_ = 0.0; }
  /// `step_mm`: motion of the tip over the `periods` of the loop that the forces were held. Returns the force
  /// to add to the device's.
  hal::Vector3 update(const hal::Vector3& reaction_n, const hal::Vector3& device_n,
                      const hal::Vector3& step_mm, const hal::Vector3& velocity_mm_per_s,
                      double periods = 1.0) noexcept {
    energy_mj_ -= dot(reaction_n + device_n, step_mm);
    damping_ = 0.0;
    const double deficit_mj = -kToleranceMj - energy_mj_;
    if (deficit_mj <= 0.0) return {};
    const double v2 = std::max(dot(velocity_mm_per_s, velocity_mm_per_s), kMinSpeedMmPerS * kMinSpeedMmPerS);
    damping_ = std::min(kMaxDampingNsPerMm, deficit_mj / (v2 * period_s_ * std::max(periods, 0.05)));
    return velocity_mm_per_s * -damping_;
  }

  /// E_h, N·mm.
  double energy_mj() const noexcept { return energy_mj_; }
  /// α in force, N·s/mm.
  double damping_n_s_per_mm() const noexcept { return damping_; }

 private:
  double period_s_;
  double energy_mj_ = 0.0;
  double damping_ = 0.0;
};

}  // namespace hapticd::rt
