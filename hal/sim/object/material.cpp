#include "hal/sim/object/material.h"

#include <algorithm>
#include <cmath>

#include "hal/sim/object/monotone_root.h"

namespace hapticd::sim {

namespace {

/// Elastic share of the force at the end of a ramp to 4 N at 0.5 N/s. The branches are linear in the elastic
/// force, so this depends on them alone: with F = F_e + Σ q_i and q̇_i = g_i Ḟ_e - q_i/τ_i, march F_e for a
/// given F.
double elastic_share_after_ramp(const std::array<RelaxationBranch, 3>& branches) {
  constexpr double kRampS = 8.0;
  constexpr int kSteps = 8000;
  constexpr double kStepS = kRampS / kSteps;
  std::array<double, 3> q{};
  double elastic = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double force = static_cast<double>(i) / kSteps;
    double intake_sum = 0.0;
    double remembered = 0.0;
    std::array<double, 3> intake{};
    for (std::size_t b = 0; b < q.size(); ++b) {
      const double decay = std::exp(-kStepS / branches[b].time_s);
      intake[b] = branches[b].share * (1.0 - decay) * branches[b].time_s / kStepS;
      intake_sum += intake[b];
      q[b] *= decay;
      remembered += q[b];
    }
    const double next = (force - remembered + intake_sum * elastic) / (1.0 + intake_sum);
    for (std::size_t b = 0; b < q.size(); ++b) q[b] += intake[b] * (next - elastic);
    elastic = next;
  }
  return elastic;
}

}  // namespace

Material::Material(const MaterialParameters& parameters, double step_s)
    : parameters_(parameters), step_s_(step_s) {
  depth_at_4n_mm_ = 4.0 / parameters.stiffness_at_4n_n_per_mm;
  // The skin carries its bit of the 4 N too.
  const double skin_n = parameters.skin_stiffness_n_per_mm * parameters.skin_depth_mm * depth_at_4n_mm_ /
                        (depth_at_4n_mm_ + parameters.skin_depth_mm);
  elastic_at_4n_n_ = std::max(0.0, 4.0 * elastic_share_after_ramp(parameters.branches) - skin_n);
  for (std::size_t b = 0; b < decay_.size(); ++b) {
    const RelaxationBranch& branch = parameters.branches[b];
    decay_[b] = std::exp(-step_s / branch.time_s);
    intake_[b] = branch.share * (1.0 - decay_[b]) * branch.time_s / step_s;
    intake_sum_ += intake_[b];
  }
}

double Material::elastic_force_n(double depth_mm) const noexcept {
  const MaterialParameters& p = parameters_;
  const double u = depth_mm / depth_at_4n_mm_;
  if (u <= 0.0) return elastic_at_4n_n_ * p.linear * u + p.skin_stiffness_n_per_mm * depth_mm;
  const double dense = std::max(0.0, (u - p.densification_onset) / (1.0 - p.densification_onset));
  return elastic_at_4n_n_ * (u * (p.linear + p.quadratic * u) + p.densifying * dense * dense * dense) +
         p.skin_stiffness_n_per_mm * p.skin_depth_mm * depth_mm / (depth_mm + p.skin_depth_mm);
}

double Material::slope(double depth_mm) const noexcept {
  const MaterialParameters& p = parameters_;
  const double u = depth_mm / depth_at_4n_mm_;
  const double scale = elastic_at_4n_n_ / depth_at_4n_mm_;
  if (u <= 0.0) return scale * p.linear + p.skin_stiffness_n_per_mm;
  const double width = 1.0 - p.densification_onset;
  const double dense = std::max(0.0, (u - p.densification_onset) / width);
  const double skin = p.skin_depth_mm / (depth_mm + p.skin_depth_mm);
  return scale * (p.linear + 2.0 * p.quadratic * u + 3.0 * p.densifying * dense * dense / width) +
         p.skin_stiffness_n_per_mm * skin * skin;
}

double Material::viscosity(double depth_mm) const noexcept {
  if (depth_mm <= 0.0) return 0.0;
  return parameters_.skin_viscosity_n_s_per_mm * depth_mm / (depth_mm + parameters_.skin_depth_mm);
}

Material::Step Material::advance(double free_depth_mm, double compliance_mm_per_n) noexcept {
  // A tip outside a flat surface, the usual case in free motion: only memory fades.
  if (free_depth_mm <= 0.0 && depth_mm_ <= 0.0) {
    for (std::size_t b = 0; b < decay_.size(); ++b) branch_force_n_[b] *= decay_[b];
    return {0.0, free_depth_mm, 0.0};
  }

  double remembered = 0.0;  // branch forces after the step if the depth did not change
  double before = elastic_n_;
  for (std::size_t b = 0; b < decay_.size(); ++b) {
    remembered += decay_[b] * branch_force_n_[b];
    before += branch_force_n_[b];
  }
  const double constant = remembered - intake_sum_ * elastic_n_;
  const double damping =
      viscosity(std::max(depth_mm_, 0.5 * (depth_mm_ + std::max(0.0, free_depth_mm)))) / step_s_;

  // Force at the end of the step, without viscosity, and mean force over it as functions of the depth at its
  // end; strictly increasing.
  const auto end_force = [&](double y) { return (1.0 + intake_sum_) * elastic_force_n(y) + constant; };
  const auto mean_force = [&](double y) { return 0.5 * (before + end_force(y)) + damping * (y - depth_mm_); };

  Step step;
  double y;
  const bool touching = free_depth_mm > 0.0 && mean_force(free_depth_mm) > 0.0;
  if (touching) {
    // y + compliance · mean_force(y) = free depth. There the force is positive, so the solution is not
    // deeper; above, bounded by the force's reaching zero.
    y = monotone_root([&](double at) { return at + compliance_mm_per_n * mean_force(at) - free_depth_mm; },
                      [&](double at) {
                        return 1.0 + compliance_mm_per_n * (0.5 * (1.0 + intake_sum_) * slope(at) + damping);
                      },
                      depth_mm_ + last_change_mm_, -1.0, free_depth_mm);
    // Matter does not reach above its flat surface: a tip thrown out within the step is let go there.
    step.mean_force_n = y > 0.0 ? std::max(0.0, mean_force(y)) : free_depth_mm / compliance_mm_per_n;
    y = std::max(0.0, y);
    step.depth_mm = y;
  } else {
    // The tip moves on alone; the surface comes back as fast as its own forces and viscosity let it (at the
    // step's end there is no force left: their mean would let it oscillate), never past flat, never through
    // the tip.
    const double alone =
        depth_mm_ > 0.0 && end_force(0.0) - damping * depth_mm_ < 0.0
            ? monotone_root([&](double at) { return end_force(at) + damping * (at - depth_mm_); },
                            [&](double at) { return (1.0 + intake_sum_) * slope(at) + damping; },
                            depth_mm_ + last_change_mm_, 0.0, depth_mm_ + 1.0)
            : 0.0;
    y = std::max({0.0, alone, free_depth_mm});
    step.depth_mm = free_depth_mm;
  }

  const double elastic = elastic_force_n(y);
  double total = elastic;
  for (std::size_t b = 0; b < decay_.size(); ++b) {
    branch_force_n_[b] = decay_[b] * branch_force_n_[b] + intake_[b] * (elastic - elastic_n_);
    total += branch_force_n_[b];
  }
  if (touching) step.force_n = std::max(0.0, total + viscosity(y) * (y - depth_mm_) / step_s_);
  last_change_mm_ = y - depth_mm_;
  depth_mm_ = y;
  elastic_n_ = elastic;
  return step;
}

}  // namespace hapticd::sim
