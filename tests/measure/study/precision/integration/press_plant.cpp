#include "tests/measure/study/precision/integration/press_plant.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::study {

PressState PressState::plus(double factor, const PressState& rate) const noexcept {
  PressState s = *this;
  s.motor_mm += factor * rate.motor_mm;
  s.motor_mm_per_s += factor * rate.motor_mm_per_s;
  s.tip_mm += factor * rate.tip_mm;
  s.tip_mm_per_s += factor * rate.tip_mm_per_s;
  s.amplifier_n += factor * rate.amplifier_n;
  for (std::size_t i = 0; i < branch_n.size(); ++i) s.branch_n[i] += factor * rate.branch_n[i];
  return s;
}

// The material's step plays no part in its elastic law.
PressEquations::PressEquations(const PressPlant& plant) : plant_(plant), material_(plant.material, 1e-4) {
  for (const sim::RelaxationBranch& branch : plant.material.branches) branch_share_ += branch.share;
}

double PressEquations::viscosity(double depth_mm) const noexcept {
  if (depth_mm <= 0.0) return 0.0;
  return plant_.material.skin_viscosity_n_s_per_mm * depth_mm / (depth_mm + plant_.material.skin_depth_mm);
}

double PressEquations::contact_n(const PressState& s, bool attached) const noexcept {
  if (!plant_.has_object || !attached || s.tip_mm <= 0.0) return 0.0;
  double force_n = (1.0 + branch_share_) * elastic_n(s.tip_mm) + viscosity(s.tip_mm) * s.tip_mm_per_s;
  for (const double p : s.branch_n) force_n += p;
  return std::max(0.0, force_n);
}

PressState PressEquations::rate(const PressState& s, double time_s, double wanted_n, bool attached,
                                double surface_mm) const noexcept {
  const sim::AxisParameters& a = plant_.axis;
  const bool touching = attached || s.tip_mm >= surface_mm;
  const double spring_n = a.structural_stiffness_n_per_mm * (s.tip_mm - s.motor_mm) +
                          a.structural_damping_n_s_per_mm * (s.tip_mm_per_s - s.motor_mm_per_s);
  const double coulomb_n = s.motor_mm_per_s == 0.0 ? 0.0 : -std::copysign(plant_.coulomb_n, s.motor_mm_per_s);
  PressState rate;
  rate.motor_mm = s.motor_mm_per_s;
  rate.motor_mm_per_s =
      1e3 / a.motor_mass_kg *
      (spring_n - a.motor_viscosity_n_s_per_mm * s.motor_mm_per_s + s.amplifier_n + coulomb_n);
  rate.tip_mm = s.tip_mm_per_s;
  rate.tip_mm_per_s =
      1e3 / a.tip_mass_kg *
      (-spring_n - a.hand_stiffness_n_per_mm * s.tip_mm - a.hand_damping_n_s_per_mm * s.tip_mm_per_s +
       plant_.hand_pull_n(time_s) - contact_n(s, touching));
  rate.amplifier_n = 2.0 * std::numbers::pi * plant_.amplifier_pole_hz * (wanted_n - s.amplifier_n);
  if (!plant_.has_object) return rate;
  const double matter_mm = std::max(0.0, touching ? s.tip_mm : surface_mm);
  const double elastic = elastic_n(matter_mm);
  for (std::size_t i = 0; i < rate.branch_n.size(); ++i) {
    const sim::RelaxationBranch& branch = plant_.material.branches[i];
    rate.branch_n[i] = -(s.branch_n[i] + branch.share * elastic) / branch.time_s;
  }
  return rate;
}

void PressEquations::follow_surface(const PressState& s, double step_s, bool& attached,
                                    double& surface_mm) const noexcept {
  if (!plant_.has_object) return;
  const bool reached = attached || s.tip_mm >= surface_mm;
  if (reached && contact_n(s, true) > 0.0) {
    attached = true;
    surface_mm = s.tip_mm;
    return;
  }
  // Alone: (1+Σg) F_e(y) + Σp + d (y - y_before)/h = 0, increasing in y; never past flat.
  const double damping = viscosity(surface_mm) / step_s;
  double memory_n = 0.0;
  for (const double p : s.branch_n) memory_n += p;
  const auto force = [&](double y) {
    return (1.0 + branch_share_) * elastic_n(y) + memory_n + damping * (y - surface_mm);
  };
  double low = 0.0;
  double high = std::max(surface_mm, 0.0) + 1.0;
  if (force(low) >= 0.0) {
    surface_mm = 0.0;
  } else {
    for (int i = 0; i < 60 && high - low > 1e-12; ++i) {
      const double middle = 0.5 * (low + high);
      (force(middle) > 0.0 ? high : low) = middle;
    }
    surface_mm = 0.5 * (low + high);
  }
  attached = s.tip_mm > surface_mm;
  if (attached) surface_mm = s.tip_mm;
}

}  // namespace hapticd::study
