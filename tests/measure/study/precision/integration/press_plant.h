#pragma once

#include <array>
#include <cstddef>

#include "hal/sim/device/axis_dynamics.h"
#include "hal/sim/hand/minimum_jerk.h"
#include "hal/sim/object/material.h"

namespace hapticd::study {

/// What is integrated: one axis of the simulated rig, pressed by a hand onto an object. Positions are
/// positive into the object, whose surface is at 0.
struct PressPlant {
  sim::AxisParameters axis{};
  sim::MaterialParameters material{};
  bool has_object = true;
  double coulomb_n = 0.0;          ///< of the motor side
  double amplifier_pole_hz = 0.0;  ///< what is wanted of the motors comes through this lag
  sim::MinimumJerk hand_path{};    ///< where the hand means the tip to be

  /// The part of the hand's force that does not depend on the state.
  double hand_pull_n(double time_s) const noexcept {
    const sim::MotionState meant = hand_path.at(time_s);
    return axis.hand_stiffness_n_per_mm * meant.position_mm +
           axis.hand_damping_n_s_per_mm * meant.velocity_mm_per_s;
  }
};

/// What is differentiated in time.
///   m1 ẍ1 = k (x2-x1) + c (ẋ2-ẋ1) - b ẋ1 + a + f_c,   |f_c| ≤ Coulomb's level, against ẋ1
///   m2 ẍ2 = -k (x2-x1) - c (ẋ2-ẋ1) - k_h x2 - c_h ẋ2 + u(t) - F
///   ȧ  = (wanted - a) ω_a
///   F  = (1+Σg) F_e(x2) + Σp + d(x2) ẋ2 ≥ 0,   ṗ_i = -(p_i + g_i F_e)/τ_i,   d(x) = c_s x/(x + d_s)
/// The relaxation branches of Material, q_i = p_i + g_i F_e, written without the derivative of F_e.
struct PressState {
  double motor_mm = 0.0;
  double motor_mm_per_s = 0.0;
  double tip_mm = 0.0;
  double tip_mm_per_s = 0.0;
  double amplifier_n = 0.0;
  std::array<double, 3> branch_n{};  ///< p_i

  /// this + factor · rate, component by component.
  PressState plus(double factor, const PressState& rate) const noexcept;
};

/// The equations, and what of them is common to all methods: the law of contact, and the surface that comes
/// back by itself where the tip has left it.
class PressEquations {
 public:
  explicit PressEquations(const PressPlant& plant);

  /// Force of the object on the tip; `attached`: matter is at the tip, wherever it may be.
  double contact_n(const PressState& s, bool attached) const noexcept;
  /// Time derivative. `surface_mm`: where matter is, if it is not attached to the tip.
  PressState rate(const PressState& s, double time_s, double wanted_n, bool attached,
                  double surface_mm) const noexcept;
  double elastic_n(double depth_mm) const noexcept { return material_.elastic_force_n(depth_mm); }
  double viscosity(double depth_mm) const noexcept;

  /// The surface after a step: at the tip, or on its way back, by backward Euler as in Material. Decides
  /// whether it is attached.
  void follow_surface(const PressState& s, double step_s, bool& attached, double& surface_mm) const noexcept;

 private:
  PressPlant plant_;
  sim::Material material_;
  double branch_share_ = 0.0;
};

}  // namespace hapticd::study
