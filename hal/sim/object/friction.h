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
  double ripple_share = 0.0;        ///< 0 … < 1: how far the level varies along the path (texture, rolling)
  double ripple_wavelength_mm = 1.0;
};

/// Elasto-plastic friction (Dupont et al. 2002) in the tangent plane with the LuGre steady state, scaled by
/// the normal force: below breakaway the bristles only bend, so vibration causes no drift; beyond it they
/// follow the exact solution of the LuGre equation over a step of constant velocity. Stable for any step.
///
/// The level the bristles tend to ripples with the way s slipped since contact, 1 + share · sin(2π
/// s/wavelength); bending is not slipping, so a tip that only vibrates stays where it is on the ripple. A
/// step takes the level of the middle of its slip: second order in slip / wavelength, and dissipative, for a
/// LuGre bristle dissipates at any positive level.
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
  /// Ends the contact: the bristles are straight again and the path begins again.
  void release() noexcept {
    bend_ = {};
    slipped_mm_ = 0.0;
  }
  /// Keeps the bristles in the present tangent plane of a curved surface.
  void project(const hal::Vector3& normal) noexcept { bend_ = bend_ - normal * dot(bend_, normal); }

 private:
  double ripple(double slipped_mm) const noexcept;
  hal::Vector3 bend_after(const hal::Vector3& slide_mm, double ripple) const noexcept;

  FrictionParameters parameters_;
  double step_s_ = 1e-4;
  hal::Vector3 bend_;        ///< elastic friction force per normal force, along the motion that caused it
  double slipped_mm_ = 0.0;  ///< since contact
};

}  // namespace hapticd::sim
