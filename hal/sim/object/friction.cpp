#include "hal/sim/object/friction.h"

#include <cmath>
#include <numbers>

namespace hapticd::sim {

using hal::Vector3;

double Friction::ripple(double slipped_mm) const noexcept {
  const FrictionParameters& p = parameters_;
  if (p.ripple_share == 0.0) return 1.0;
  return 1.0 + p.ripple_share * std::sin(2.0 * std::numbers::pi * slipped_mm / p.ripple_wavelength_mm);
}

Vector3 Friction::bend_after(const Vector3& slide_mm, double ripple) const noexcept {
  const FrictionParameters& p = parameters_;
  const double stiffness_per_mm = p.kinetic / p.presliding_mm;
  const Vector3 elastic = bend_ + slide_mm * stiffness_per_mm;
  constexpr double kBreakaway = 0.7;  // of the kinetic level: bristles only bend up to there
  const double breakaway = kBreakaway * p.kinetic * ripple;
  if (dot(elastic, elastic) <= breakaway * breakaway) return elastic;

  const double distance = std::sqrt(dot(slide_mm, slide_mm));
  if (distance == 0.0) return bend_;
  const double ratio = distance / step_s_ / p.stribeck_velocity_mm_per_s;
  const double level = ripple * p.kinetic * (1.0 + (p.static_ratio - 1.0) * std::exp(-ratio * ratio));
  const Vector3 sliding = slide_mm * (level / distance);
  return sliding + (bend_ - sliding) * std::exp(-stiffness_per_mm * distance / level);
}

Vector3 Friction::advance(const Vector3& free_slide_mm, double compliance_mm_per_n,
                          double mean_normal_n) noexcept {
  // The force depends on the slide it shortens. Fixed-point: each pass contracts by
  // normal · compliance · stiffness · (1/2 + damping/step), below 0.3 for everything that is simulated here.
  const FrictionParameters& p = parameters_;
  Vector3 force;
  Vector3 bend = bend_;
  double slip_mm = 0.0;
  for (int pass = 0; pass < 3; ++pass) {
    const Vector3 slide = free_slide_mm + force * compliance_mm_per_n;
    bend = bend_after(slide, ripple(slipped_mm_ + 0.5 * slip_mm));
    const Vector3 slip = slide - (bend - bend_) * (p.presliding_mm / p.kinetic);
    slip_mm = std::sqrt(dot(slip, slip));
    const Vector3 coefficient = (bend_ + bend) * 0.5 + (bend - bend_) * (p.bristle_damping_s / step_s_) +
                                slide * (p.viscous_s_per_mm / step_s_);
    force = coefficient * -mean_normal_n;
  }
  bend_ = bend;
  slipped_mm_ += slip_mm;
  return force;
}

}  // namespace hapticd::sim
