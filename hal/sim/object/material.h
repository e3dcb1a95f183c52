#pragma once

#include <array>

namespace hapticd::sim {

/// One relaxation branch: a share of the elastic force that fades with time at constant deformation.
struct RelaxationBranch {
  double share = 0.0;  ///< instantaneous force of the branch over the elastic force
  double time_s = 1.0;
};

/// How an object answers to being pressed, along the surface normal. Deliberately no Hunt-Crossley law.
///
///   elastic   φ(u) = a u + b u² + c max(0, (u - u_d)/(1 - u_d))³, u = depth / depth at 4 N, a + b + c = 1
///   relaxing  quasi-linear viscoelastic: each branch carries its share of dF_e, fading exponentially
///   skin      k_s d x/(x + d) and a viscosity that grows the same way: what makes an onset abrupt
struct MaterialParameters {
  double stiffness_at_4n_n_per_mm = 1.0;  ///< secant at 4 N, loaded at 0.5 N/s
  double linear = 1.0;                    ///< a
  double quadratic = 0.0;                 ///< b
  double densifying = 0.0;                ///< c
  double densification_onset = 0.5;       ///< u_d
  std::array<RelaxationBranch, 3> branches{};
  double skin_stiffness_n_per_mm = 0.0;
  double skin_viscosity_n_s_per_mm = 0.0;
  double skin_depth_mm = 0.1;
};

/// State and step of the law. The step solves tip and material together and implicitly: trapezoidal in the
/// elastic force, exact in the branches (second order), one monotone scalar equation by safeguarded Newton.
/// Stable for any stiffness.
class Material {
 public:
  Material() = default;
  Material(const MaterialParameters& parameters, double step_s);

  /// What one step did.
  struct Step {
    double mean_force_n = 0.0;  ///< normal force averaged over the step, ≥ 0: what moves the tip
    double depth_mm = 0.0;      ///< of the tip after it
    double force_n = 0.0;       ///< normal force at its end: what a sensor reads
  };

  /// `free_depth_mm`: where the tip would be after the step without contact (negative: outside);
  /// `compliance_mm_per_n`: how far a newton throughout the step holds it back.
  Step advance(double free_depth_mm, double compliance_mm_per_n) noexcept;

  /// Depth of the surface itself; lags behind a tip that leaves.
  double depression_mm() const noexcept { return depth_mm_; }
  /// Elastic force of the law alone, N.
  double elastic_force_n(double depth_mm) const noexcept;

 private:
  double slope(double depth_mm) const noexcept;
  double viscosity(double depth_mm) const noexcept;

  MaterialParameters parameters_;
  double step_s_ = 1e-4;
  double depth_at_4n_mm_ = 1.0;
  double elastic_at_4n_n_ = 4.0;    ///< what of the 4 N is elastic in the defining test
  std::array<double, 3> decay_{};   ///< exp(-h/τ)
  std::array<double, 3> intake_{};  ///< share · (1 - exp(-h/τ)) τ/h
  double intake_sum_ = 0.0;

  double depth_mm_ = 0.0;
  double last_change_mm_ = 0.0;  ///< where to look first in the next step
  double elastic_n_ = 0.0;       ///< at depth_mm_
  std::array<double, 3> branch_force_n_{};
};

}  // namespace hapticd::sim
