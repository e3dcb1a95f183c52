#pragma once

#include <optional>

#include "rt/friction/dahl.h"
#include "rt/friction/friction_model.h"

namespace hapticd::rt::test {

/// A tip on a surface with exact Dahl friction (or Maxwell-slip, if the parameters have elements) and
/// viscosity: what it feels, and what is true. The caller moves it; the surface says which normal it has
/// there.
class StrokedSurface {
 public:
  explicit StrokedSurface(const FrictionParameters& friction, double rate_hz = 1000.0)
      : friction_(friction), rate_hz_(rate_hz) {
    if (friction.maxwell_slip) maxwell_slip_.emplace(*friction.maxwell_slip);
  }

  /// Moves the tip by `step_mm` on a surface of this normal under this normal force. Returns the reaction on
  /// the tool.
  hal::Vector3 move(const hal::Vector3& step_mm, const hal::Vector3& normal, double normal_n) {
    slide(across(step_mm, normal), normal);
    const hal::Vector3 viscous = across(step_mm, normal) * (rate_hz_ * friction_.viscous_n_s_per_mm);
    friction_n_ = (built_up_ * (friction_.kinetic * normal_n) + viscous) * -1.0;
    return normal * normal_n + friction_n_;
  }
  /// Asperities bend without the encoders seeing it.
  void slide(const hal::Vector3& slide_mm, const hal::Vector3& normal) {
    const double length = norm(built_up_);
    if (maxwell_slip_) {
      built_up_ = maxwell_slip_->step(slide_mm, normal) * (1.0 / friction_.kinetic);
      return;
    }
    built_up_ = direction_or(across(built_up_, normal), {}) * length;  // carried along a curved surface
    built_up_ = dahl_step(built_up_, slide_mm, friction_.presliding_mm);
  }
  const hal::Vector3& friction_n() const { return friction_n_; }

 private:
  FrictionParameters friction_;
  double rate_hz_;
  std::optional<PlanarMaxwellSlip> maxwell_slip_;
  hal::Vector3 built_up_;
  hal::Vector3 friction_n_;
};

}  // namespace hapticd::rt::test
