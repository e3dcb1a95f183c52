#pragma once

#include "hal/samples.h"

namespace hapticd::sim {

/// Friction of a tip on a surface.
struct FrictionParameters {
  double kinetic = 0.5;       ///< μ_k
  double static_ratio = 1.2;  ///< μ_s / μ_k: the Stribeck drop is from it to 1
  double stribeck_velocity_mm_per_s = 5.0;
  double presliding_mm = 0.1;       ///< μ_k over the bristles' stiffness per normal force
  double viscous_s_per_mm = 0.0;    ///< per normal force and sliding velocity
  double bristle_damping_s = 5e-5;  ///< force per rate of the bristles' own force
};

/// Elasto-plastic friction (Dupont et al. 2002) in the tangent plane with the LuGre steady state, scaled by
/// the normal force: below breakaway the bristles only bend, so vibration causes no drift; beyond it they
/// follow the exact solution of the LuGre equation over a step of constant velocity. Stable for any step.
class Friction {
 public:
  Friction() = default;
  Friction(const FrictionParameters& parameters, double step_s) noexcept
      : parameters_(parameters), step_s_(step_s) {}

  /// Mean tangential force on the tip (N) over a step in which it moves by `free_slide_mm` in the tangent
  /// plane if nothing held it back, `compliance_mm_per_n` less per newton; `mean_normal_n` ≥ 0. Implicit in
  /// the motion.
  hal::Vector3 advance(const hal::Vector3& free_slide_mm, double compliance_mm_per_n,
                       double mean_normal_n) noexcept;
  /// Out of contact: the bristles are straight again.
  void release() noexcept { bend_ = {}; }
  /// Keeps the bristles in the present tangent plane of a curved surface.
  void project(const hal::Vector3& normal) noexcept { bend_ = bend_ - normal * dot(bend_, normal); }

 private:
  hal::Vector3 bend_after(const hal::Vector3& slide_mm) const noexcept;

  FrictionParameters parameters_;
  double step_s_ = 1e-4;
  hal::Vector3 bend_;  ///< elastic friction force per normal force, along the motion that caused it
};

}  // namespace hapticd::sim
