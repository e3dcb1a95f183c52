#include "hal/sim/friction.h"

#include <cmath>

namespace hapticd::sim {

using hal::Vector3;

Vector3 Friction::bend_after(const Vector3& slide_mm) const noexcept {
  const FrictionParameters& p = parameters_;
  const double stiffness_per_mm = p.kinetic / p.presliding_mm;
  const Vector3 elastic = bend_ + slide_mm * stiffness_per_mm;
  constexpr double kBreakaway = 0.7;  // of the kinetic level: bristles only bend up to there
  const double breakaway = kBreakaway * p.kinetic;
  if (dot(elastic, elastic) <= breakaway * breakaway) return elastic;

  const double distance = std::sqrt(dot(slide_mm, slide_mm));
  if (distance == 0.0) return bend_;
  const double ratio = distance / step_s_ / p.stribeck_velocity_mm_per_s;
  const double level = p.kinetic * (1.0 + (p.static_ratio - 1.0) * std::exp(-ratio * ratio));
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
  for (int pass = 0; pass < 3; ++pass) {
    const Vector3 slide = free_slide_mm + force * compliance_mm_per_n;
    bend = bend_after(slide);
    const Vector3 coefficient = (bend_ + bend) * 0.5 + (bend - bend_) * (p.bristle_damping_s / step_s_) +
                                slide * (p.viscous_s_per_mm / step_s_);
    force = coefficient * -mean_normal_n;
  }
  bend_ = bend;
  return force;
}

}  // namespace hapticd::sim
