#pragma once

#include "hal/samples.h"
#include "rt/friction/friction_model.h"

namespace hapticd::rt {

/// Deformation direction with all that a tick knows about it.
///
/// Friction is a vector z in the tangent plane (dahl.h), built up by the smoothed velocity, so it neither
/// jumps with an encoder step nor forgets at rest; a Coulomb tip is one with a very short way. With
/// f_r = f_n (u - μ_k z) - μ_b v_t and z across u the reaction gives f_n and u in closed form, no guess of
/// the last tick's normal needed:
///
///   g = f_r + μ_b v_t,  f_n = |g| / √(1 + μ_k² |z|²),  u = g/f_n + μ_k z.
///
/// How far a tick may be believed depends on the load: the angle's noise is σ_f/f_n. A scalar Kalman gain
/// weighs it against how far the surface can have turned since the last tick, v_t T / r.
class TrackedDirection {
 public:
  /// `force_noise_n`: standard deviation of one component per tick.
  TrackedDirection(const FrictionParameters& friction, double force_noise_n, double rate_hz) noexcept;

  void begin(const hal::Vector3& reaction_n) noexcept;
  void update(const hal::Vector3& reaction_n, const hal::Vector3& velocity_mm_per_s) noexcept;

  const hal::Vector3& normal() const noexcept { return normal_; }
  const hal::Vector3& friction_n() const noexcept { return friction_n_; }
  /// Standard deviation of the angle as the filter sees it, friction error aside.
  double deviation_rad() const noexcept;

 private:
  static constexpr double kTightestRadiusMm = 10.0;  // of what is stroked without lifting off
  static constexpr double kDriftRadPerS = 0.5;       // a surface turns a little under a tip at rest, too

  FrictionParameters friction_;
  double period_s_;
  double force_variance_n2_;
  hal::Vector3 normal_{0.0, 0.0, 1.0};
  hal::Vector3 built_up_;  ///< z
  hal::Vector3 friction_n_;
  double variance_rad2_ = 0.0;
};

}  // namespace hapticd::rt
