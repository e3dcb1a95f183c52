#pragma once

#include <array>
#include <optional>

#include "hal/error.h"
#include "hal/samples.h"
#include "hal/sim/object/material.h"
#include "hal/sim/object/reduced_function.h"

namespace hapticd::sim {

/// A stiff sphere of 12.5 mm radius in a phantom.
struct PhantomInclusion {
  /// Force over depth at 10 mm where the sphere lies 25 mm below the apex, pressed over it.
  double stiffness_at_10mm_n_per_mm = 0.54;
  double depth_mm = 25.0;               ///< of its centre below the surface; 19 … 31
  hal::Vector3 axis{0.0, 0.0, 1.0};     ///< from the centre of the base through the sphere; length 1
  double internal_friction = 0.15;      ///< between sphere and tissue: of the force that it adds
  double internal_presliding_mm = 0.3;  ///< of its movement in the tissue, before it slips
};

/// A half-sphere of soft silicone, 55 mm in radius and bonded to the table, pressed by a ball of 8 mm.
struct PhantomParameters {
  static constexpr double kRadiusMm = 55.0;
  static constexpr double kTipRadiusMm = 8.0;
  double stiffness_at_10mm_n_per_mm = 0.13;
  std::array<RelaxationBranch, 3> branches{{{0.10, 0.005}, {0.08, 0.20}, {0.10, 3.0}}};
  std::optional<PhantomInclusion> inclusion{};

  static constexpr double kMaxAsideMm = 25.0;
  /// Puts the inclusion straight below a tip that touches at `aside_mm`; z is not used. Needs an inclusion.
  std::optional<hal::Error> put_inclusion(const hal::Vector3& aside_mm);
};

/// Matter of a phantom: the potential energy of a finite-element body in large deformation, reduced to a
/// smooth function of the tip's place (phantom_energy.cpp), its force the gradient. On top of it relaxes as
/// the other silicone does, and the sphere rubs in its tissue, independent of rate. The tip is the lowest
/// point of its ball; what it touches is a sphere of the sum of both radii.
class PhantomBody {
 public:
  PhantomBody(const PhantomParameters& parameters, double step_s);

  struct Step {
    hal::Vector3 force_n;  ///< on the tip
    double depth_mm = 0.0;
    hal::Vector3 inclusion_mm;  ///< movement of the sphere
  };
  /// Advances by one step: `free_mm`, where the tip would be without contact, in the object's frame;
  /// `compliance_mm_per_n`: how far a newton throughout the step holds it back.
  Step advance(const hal::Vector3& free_mm, double compliance_mm_per_n) noexcept;

  /// Force without relaxation and friction.
  hal::Vector3 elastic_force_n(const hal::Vector3& tip_mm) const noexcept;
  double energy_n_mm(const hal::Vector3& tip_mm) const noexcept;
  hal::Vector3 inclusion_mm(const hal::Vector3& tip_mm) const noexcept;

 private:
  struct Polar {
    double depth_mm = 0.0;
    double distance_mm = 1.0;
    double angle_rad = 0.0;
    hal::Vector3 out;   ///< unit, from the base's centre
    hal::Vector3 away;  ///< unit, across it, away from the axis
  };
  static Polar polar(const hal::Vector3& tip_mm, const hal::Vector3& axis) noexcept;
  hal::Vector3 gradient_force_n(const ReducedFunction& energy, const Polar& at) const noexcept;
  hal::Vector3 excess_n(const hal::Vector3& tip_mm) const noexcept;
  hal::Vector3 internal_friction_n(const hal::Vector3& tip_mm, double excess_n) noexcept;
  void calibrate();
  void release() noexcept;
  /// Force after a steady press to 10 mm over the axis, at 5 mm/s.
  double press_to_10mm();

  PhantomParameters parameters_;
  double step_s_;
  double tissue_scale_ = 1.0;
  double excess_scale_ = 1.0;
  ReducedFunction excess_;
  ReducedFunction movement_along_;
  ReducedFunction movement_across_;  ///< over the angle

  std::array<double, 3> decay_{};
  std::array<double, 3> gain_{};
  // State.
  hal::Vector3 elastic_n_;
  std::array<hal::Vector3, 3> branch_n_{};
  hal::Vector3 last_inclusion_mm_;
  hal::Vector3 friction_n_;  ///< of the tissue on the sphere
  double friction_stiffness_n_per_mm_ = 0.0;
};

}  // namespace hapticd::sim
