#pragma once

#include <array>

#include "hal/samples.h"
#include "hal/sim/object/friction.h"

namespace hapticd::sim {

/// One of the springs in series with dry friction that a contact consists of.
struct FrictionElement {
  double stiffness_share = 0.2;  ///< of the contact's; all together 1
  double slip_distance = 1.0;    ///< in presliding lengths
};

/// What the general friction has besides FrictionParameters, which hold at `reference_load_n` and
/// `reference_speed_mm_per_s`.
struct GeneralFrictionParameters {
  double load_exponent = 0.88;            ///< level ~ load^this
  double stiffness_exponent = 1.0 / 3.0;  ///< tangential stiffness ~ load^this, below the level's
  double reference_load_n = 2.0;
  double reference_speed_mm_per_s = 50.0;
  double stribeck_shape = 0.7;      ///< static excess ~ exp(-(v/v_s)^this)
  double growth_per_decade = 0.05;  ///< of the kinetic level with the speed
  /// Elements from a recorded reciprocating contact at 5 N, whose branches are straight to 0.85 of twice the
  /// presliding length and level at 1.3: much sharper than an exponential.
  std::array<FrictionElement, 5> elements{
      {{0.30, 0.87}, {0.35, 0.96}, {0.20, 1.05}, {0.10, 1.19}, {0.05, 1.48}}};
};

/// Maxwell-slip friction in the tangent plane: springs that stretch until each slips at its own limit. Level
/// and stiffness grow with different powers of the load, both below 1, so the presliding length does, too;
/// sliding friction drops with speed as stretched exponential and grows again with its logarithm.
///
/// Elements return radially to their limits. A spring that becomes stiffer under growing load keeps its force
/// (new contact bears none), one that becomes softer its stretch: no change of load creates energy. A step is
/// exact while elements only stretch and dissipates whatever it is; first order at the kinks of slipping.
class MaxwellSlipFriction {
 public:
  MaxwellSlipFriction() = default;
  MaxwellSlipFriction(const FrictionParameters& level, const GeneralFrictionParameters& shape,
                      double step_s) noexcept;

  /// Advances as Friction::advance().
  hal::Vector3 advance(const hal::Vector3& free_slide_mm, double compliance_mm_per_n,
                       double mean_normal_n) noexcept;
  void release() noexcept;
  void project(const hal::Vector3& normal) noexcept;

  /// Sliding level at a load and a speed, without ripple, N.
  double level_n(double normal_n, double speed_mm_per_s) const noexcept;
  /// Level over stiffness at a load, mm.
  double presliding_mm(double normal_n) const noexcept;
  /// Energy held in the springs, N·mm.
  double stored_n_mm() const noexcept;

 private:
  using Forces = std::array<hal::Vector3, 5>;
  double stiffness_n_per_mm(double normal_n) const noexcept;
  double speed_factor(double speed_mm_per_s) const noexcept;
  double ripple(double slipped_mm) const noexcept;

  FrictionParameters level_;
  GeneralFrictionParameters shape_;
  double step_s_ = 1e-4;
  double limit_scale_ = 1.0;  ///< makes the elements' limits the level together
  double growth_at_reference_ = 1.0;

  Forces force_n_{};                     ///< of the springs, along the motion that stretched them
  double stiffness_now_n_per_mm_ = 0.0;  ///< that they were last stretched with
  double slipped_mm_ = 0.0;
};

}  // namespace hapticd::sim
