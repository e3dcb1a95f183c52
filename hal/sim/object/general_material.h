#pragma once

#include <array>
#include <cstddef>

#include "hal/sim/object/material.h"

namespace hapticd::sim {

/// A spring in series with dry friction whose limit grows with the strain: rate-independent hysteresis.
struct SlipShare {
  double share = 0.0;  ///< stiffness over the settled one at the depth of 4 N
  double limit = 0.1;  ///< strain of the spring at which it slips, over the total strain; 0 … < 1
};

/// What the general law has besides elastic curve and skin, which are those of MaterialParameters. All
/// shares are of the force at the depth of 4 N.
struct GeneralMaterialParameters {
  double fading_share = 0.5;       ///< what of the force fades as t^-power; its size a second after a step
  double power = 0.1;              ///< 0 < power < 1
  double strain_growth = 1.0;      ///< strain is u (1 + growth u/2), u = depth / depth at 4 N, before scaling
  double slower_when_dense = 1.0;  ///< factor of all times at the depth of 4 N, ≥ 1; grows as u², bounded
  double pore_share = 0.0;         ///< what drains through pores: a spring behind a flow …
  double pore_time_s = 0.01;       ///< … with this time at low rates (Darcy) …
  double pore_strain_rate_per_s = 5.0;  ///< … whose resistance has doubled at this rate (Forchheimer)
  std::array<SlipShare, 3> slips{};
};

/// A law that neither a product of time and depth (quasi-linear viscoelastic) nor Hunt-Crossley can be:
///
///   e(u)     strain, a polynomial; every memory is one of strain, so that its force is e'(u) times its own
///   settled  (1 - fading) φ(u), the elastic curve of MaterialParameters; the part that never fades
///   fading   fading · t^-power by 2 Maxwell elements a decade, 0.2 ms … 6e4 s: within 0.2 % of the power law
///            from 1 ms to 1000 s. All times grow with depth: dense matter is slower
///   pores    a Maxwell element whose flow resists by τ v (1 + |v|/v_f): stiffens faster than the rate grows
///   slips    Maxwell-slip elements with limits in proportion to strain: hysteresis whatever the rate, closed
///            at zero, so that it leaves no dent
///   skin     stiffness and viscosity, as in the separable law
///
/// One step solves tip and matter together and implicitly. Each part takes in the exact work of the step
/// (discrete gradients; Maxwell elements by the trapezoid, damped if their time is short against the step),
/// so no path and no step creates energy. Second order if the step is below twice each element's time. Cost:
/// a few operations per element and step; one scalar equation as in the separable law.
class GeneralMaterial {
 public:
  using Step = Material::Step;
  static constexpr std::size_t kModes = 18;

  GeneralMaterial() = default;
  /// Scaled so that the secant at 4 N, loaded at 0.5 N/s, is `stiffness_at_4n_n_per_mm`: by loading it.
  GeneralMaterial(const MaterialParameters& shape, const GeneralMaterialParameters& memory, double step_s);

  /// Advances as Material::advance().
  Step advance(double free_depth_mm, double compliance_mm_per_n) noexcept;

  double depression_mm() const noexcept { return depth_mm_; }
  /// Force that is left at this depth when the step's modes have faded, without hysteresis.
  double settled_force_n(double depth_mm) const noexcept;
  /// Energy held in springs, N·mm. Never grows by more than the work done on the matter.
  double stored_n_mm() const noexcept;

 private:
  struct Answer {  ///< of all memories to a change of strain within the step
    double force = 0.0;
    double slope = 0.0;
  };
  struct Slipped {
    double mean = 0.0;
    double slope = 0.0;
    double end = 0.0;
  };

  void load_to_4n();
  double strain(double u) const noexcept;
  double strain_slope(double u) const noexcept;
  double mean_strain_slope(double to_u) const noexcept;
  double mean_settled(double to_u, double& slope) const noexcept;
  double mean_skin_n(double to_mm, double& slope) const noexcept;
  double settled(double u, double& slope) const noexcept;
  double skin_n(double mm, double& slope) const noexcept;
  double pore_flow(double change) const noexcept;
  static Slipped slip(const SlipShare& element, double spring, double from, double change) noexcept;
  Answer mean_memory(double change) const noexcept;
  Answer end_memory(double change) const noexcept;
  Answer mean_force_n(double to_mm) const noexcept;
  Answer end_force_n(double to_mm) const noexcept;
  void prepare_step() noexcept;
  void finish_step(double to_mm) noexcept;
  double viscosity(double depth_mm) const noexcept;

  MaterialParameters shape_;
  GeneralMaterialParameters memory_;
  double step_s_ = 1e-4;
  double depth_at_4n_mm_ = 1.0;
  double scale_n_ = 4.0;      ///< settled force at the depth of 4 N if nothing faded
  double strain_norm_ = 1.0;  ///< makes e e' = 1 at u = 1
  double never_fades_ = 0.0;  ///< stiffness of what is slower than the slowest mode
  std::array<double, kModes> stiffness_{};
  std::array<double, kModes> step_over_time_{};  ///< at the surface

  // State.
  double depth_mm_ = 0.0;
  double last_change_mm_ = 0.0;
  double strain_ = 0.0;
  std::array<double, kModes> stretch_{};  ///< of the modes' springs, in strain
  double pore_stretch_ = 0.0;
  std::array<double, 3> slip_stretch_{};

  // Values of the step under way: memory of modes is linear in the change of strain.
  std::array<double, kModes> rate_{};    ///< share of the middle's stretch that fades within the step
  std::array<double, kModes> weight_{};  ///< θ of the step: ½, more where the mode is faster than the step
  Answer modes_mean_;
  Answer modes_end_;
  double pore_time_s_ = 0.01;
  double pore_weight_ = 0.5;
};

}  // namespace hapticd::sim
