#include "hal/sim/object/general_friction.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::sim {

using hal::Vector3;

namespace {

double length(const Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}

/// Force nearest to the given one within a limit.
Vector3 within(const Vector3& force_n, double limit_n) noexcept {
  const double squared = dot(force_n, force_n);
  return squared <= limit_n * limit_n ? force_n : force_n * (limit_n / std::sqrt(squared));
}

}  // namespace

MaxwellSlipFriction::MaxwellSlipFriction(const FrictionParameters& level,
                                         const GeneralFrictionParameters& shape, double step_s) noexcept
    : level_(level), shape_(shape), step_s_(step_s) {
  double sum = 0.0;
  for (const FrictionElement& element : shape.elements)
    sum += element.stiffness_share * element.slip_distance;
  limit_scale_ = 1.0 / sum;
  growth_at_reference_ =
      1.0 + shape.growth_per_decade *
                std::log10(1.0 + shape.reference_speed_mm_per_s / level.stribeck_velocity_mm_per_s);
}

double MaxwellSlipFriction::speed_factor(double speed_mm_per_s) const noexcept {
  const double relative = speed_mm_per_s / level_.stribeck_velocity_mm_per_s;
  const double excess = (level_.static_ratio - 1.0) * std::exp(-std::pow(relative, shape_.stribeck_shape));
  return (1.0 + shape_.growth_per_decade * std::log10(1.0 + relative)) / growth_at_reference_ + excess;
}

double MaxwellSlipFriction::level_n(double normal_n, double speed_mm_per_s) const noexcept {
  return level_.kinetic * shape_.reference_load_n *
         std::pow(normal_n / shape_.reference_load_n, shape_.load_exponent) * speed_factor(speed_mm_per_s);
}

double MaxwellSlipFriction::stiffness_n_per_mm(double normal_n) const noexcept {
  return level_.kinetic * shape_.reference_load_n / level_.presliding_mm *
         std::pow(normal_n / shape_.reference_load_n, shape_.stiffness_exponent);
}

double MaxwellSlipFriction::presliding_mm(double normal_n) const noexcept {
  return level_.presliding_mm *
         std::pow(normal_n / shape_.reference_load_n, shape_.load_exponent - shape_.stiffness_exponent);
}

double MaxwellSlipFriction::ripple(double slipped_mm) const noexcept {
  if (level_.ripple_share == 0.0) return 1.0;
  return 1.0 +
         level_.ripple_share * std::sin(2.0 * std::numbers::pi * slipped_mm / level_.ripple_wavelength_mm);
}

double MaxwellSlipFriction::stored_n_mm() const noexcept {
  double sum = 0.0;
  for (std::size_t i = 0; i < force_n_.size(); ++i) {
    const double k = shape_.elements[i].stiffness_share * stiffness_now_n_per_mm_;
    if (k > 0.0) sum += 0.5 * dot(force_n_[i], force_n_[i]) / k;
  }
  return sum;
}

void MaxwellSlipFriction::release() noexcept {
  force_n_ = {};
  stiffness_now_n_per_mm_ = 0.0;
  slipped_mm_ = 0.0;
}

void MaxwellSlipFriction::project(const Vector3& normal) noexcept {
  for (Vector3& force_n : force_n_) force_n = force_n - normal * dot(force_n, normal);
}

Vector3 MaxwellSlipFriction::advance(const Vector3& free_slide_mm, double compliance_mm_per_n,
                                     double mean_normal_n) noexcept {
  if (!(mean_normal_n > 0.0)) {
    release();
    return {};
  }
  const double stiffness = stiffness_n_per_mm(mean_normal_n);
  if (stiffness < stiffness_now_n_per_mm_) {
    for (Vector3& force_n : force_n_) force_n = force_n * (stiffness / stiffness_now_n_per_mm_);
  }
  stiffness_now_n_per_mm_ = stiffness;

  // The force depends on the slide it shortens. Passes with the stiffest the contact can be: exact where it
  // only stretches, and they close in whatever the stiffness.
  const double damping_n_s_per_mm = stiffness * level_.bristle_damping_s;
  const double viscous_n_s_per_mm = mean_normal_n * level_.viscous_s_per_mm;
  const double stiffest = 0.5 * stiffness + (damping_n_s_per_mm + viscous_n_s_per_mm) / step_s_;
  const double yielding = compliance_mm_per_n * stiffest;
  Vector3 slide = free_slide_mm * (1.0 / (1.0 + yielding));
  const double level_at_rest = level_.kinetic * shape_.reference_load_n *
                               std::pow(mean_normal_n / shape_.reference_load_n, shape_.load_exponent);
  double level = 0.0;
  Vector3 force;
  Forces end;
  double min_slip_mm = 0.0;
  constexpr int kMaxPasses = 4;
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    // The level's own speed dependence is mild: twice is enough.
    if (pass < 2) {
      level = level_at_rest * speed_factor(length(slide) / step_s_) * ripple(slipped_mm_ + 0.5 * min_slip_mm);
    }
    Vector3 sum = slide * (viscous_n_s_per_mm / step_s_);
    double min_squared_mm2 = HUGE_VAL;
    for (std::size_t i = 0; i < force_n_.size(); ++i) {
      const FrictionElement& element = shape_.elements[i];
      const double k = element.stiffness_share * stiffness;
      const double limit = element.stiffness_share * element.slip_distance * limit_scale_ * level;
      const Vector3 start = within(force_n_[i], limit);
      const Vector3 stretched = start + slide * k;
      end[i] = within(stretched, limit);
      sum = sum + (start + end[i]) * 0.5;
      const Vector3 over = stretched - end[i];
      const double slip_squared = dot(over, over) / (k * k);
      if (slip_squared == 0.0) sum = sum + slide * (element.stiffness_share * damping_n_s_per_mm / step_s_);
      min_squared_mm2 = std::min(min_squared_mm2, slip_squared);
    }
    force = sum * -1.0;
    min_slip_mm = std::sqrt(min_squared_mm2);
    const Vector3 next =
        (free_slide_mm + (force + slide * stiffest) * compliance_mm_per_n) * (1.0 / (1.0 + yielding));
    const Vector3 change = next - slide;
    if (pass > 0 && dot(change, change) <= 1e-10 * dot(slide, slide)) break;
    if (pass + 1 < kMaxPasses) slide = next;
  }
  force_n_ = end;
  slipped_mm_ += min_slip_mm;
  return force;
}

}  // namespace hapticd::sim
