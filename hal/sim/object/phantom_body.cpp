#include "hal/sim/object/phantom_body.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hal/sim/object/phantom_energy.h"

namespace hapticd::sim {

using hal::Vector3;

namespace {

constexpr double kSumOfRadiiMm = PhantomParameters::kRadiusMm + PhantomParameters::kTipRadiusMm;
constexpr double kMovementStepMm = 1e-3;  // for the slope of the sphere's movement

double size_of(const Vector3& v) noexcept {
  return std::sqrt(dot(v, v));
}

}  // namespace

std::optional<hal::Error> PhantomParameters::put_inclusion(const Vector3& aside_mm) {
  const double off_mm = std::hypot(aside_mm.x, aside_mm.y);
  if (!(off_mm <= kMaxAsideMm)) {
    return hal::Error{"the inclusion would lie too far aside", "simulated phantom",
                      std::to_string(off_mm) + " mm", "0 … 25 mm from the middle", ""};
  }
  const Vector3 out{aside_mm.x / kSumOfRadiiMm, aside_mm.y / kSumOfRadiiMm, 0.0};
  inclusion->axis = out + Vector3{0.0, 0.0, std::sqrt(1.0 - dot(out, out))};
  return std::nullopt;
}

PhantomBody::PhantomBody(const PhantomParameters& parameters, double step_s)
    : parameters_(parameters), step_s_(step_s) {
  for (std::size_t i = 0; i < decay_.size(); ++i) {
    const RelaxationBranch& branch = parameters_.branches[i];
    const double periods = step_s / branch.time_s;
    decay_[i] = std::exp(-periods);
    gain_[i] = branch.share * -std::expm1(-periods) / periods;
  }
  calibrate();
}

void PhantomBody::calibrate() {
  // Each force is in proportion to its scale, friction included.
  const auto inclusion = parameters_.inclusion;
  parameters_.inclusion.reset();
  tissue_scale_ = 10.0 * parameters_.stiffness_at_10mm_n_per_mm / press_to_10mm();
  if (inclusion) {
    const double tissue_n = press_to_10mm();
    parameters_.inclusion = inclusion;
    parameters_.inclusion->axis = {0.0, 0.0, 1.0};
    const auto take = [&](double depth_mm) {
      const InclusionFunctions functions = inclusion_functions(depth_mm);
      excess_ = functions.energy;
      movement_along_ = functions.along;
      movement_across_ = functions.across;
    };
    take(25.0);
    excess_scale_ = (10.0 * inclusion->stiffness_at_10mm_n_per_mm - tissue_n) / (press_to_10mm() - tissue_n);
    take(inclusion->depth_mm);
    parameters_.inclusion = inclusion;
  }
  release();
}

double PhantomBody::press_to_10mm() {
  constexpr double kSpeedMmPerS = 5.0;
  release();
  double force_n = 0.0;
  const int steps = static_cast<int>(std::lround(10.0 / kSpeedMmPerS / step_s_));
  for (int i = 1; i <= steps; ++i) {
    force_n = advance({0.0, 0.0, -kSpeedMmPerS * step_s_ * i}, 0.0).force_n.z;
  }
  return force_n;
}

void PhantomBody::release() noexcept {
  elastic_n_ = {};
  branch_n_ = {};
  last_inclusion_mm_ = {};
  friction_n_ = {};
  friction_stiffness_n_per_mm_ = 0.0;
}

PhantomBody::Polar PhantomBody::polar(const Vector3& tip_mm, const Vector3& axis) noexcept {
  const Vector3 from_base = tip_mm + Vector3{0.0, 0.0, kSumOfRadiiMm};
  Polar p;
  p.distance_mm = std::max(1.0, size_of(from_base));
  p.depth_mm = kSumOfRadiiMm - p.distance_mm;
  p.out = from_base * (1.0 / p.distance_mm);
  const double along = dot(p.out, axis);
  const Vector3 across = p.out - axis * along;
  const double sine = size_of(across);
  p.angle_rad = std::atan2(sine, along);
  if (sine > 1e-9) p.away = (p.out * along - axis) * (1.0 / sine);
  return p;
}

Vector3 PhantomBody::gradient_force_n(const ReducedFunction& energy, const Polar& at) const noexcept {
  const ReducedFunction::Value u = energy.at(at.depth_mm, at.angle_rad);
  return at.out * u.by_depth - at.away * (u.by_angle / at.distance_mm);
}

Vector3 PhantomBody::excess_n(const Vector3& tip_mm) const noexcept {
  if (!parameters_.inclusion) return {};
  return gradient_force_n(excess_, polar(tip_mm, parameters_.inclusion->axis)) * excess_scale_;
}

Vector3 PhantomBody::elastic_force_n(const Vector3& tip_mm) const noexcept {
  return gradient_force_n(tissue_energy(), polar(tip_mm, {0.0, 0.0, 1.0})) * tissue_scale_ + excess_n(tip_mm);
}

double PhantomBody::energy_n_mm(const Vector3& tip_mm) const noexcept {
  const Polar upright = polar(tip_mm, {0.0, 0.0, 1.0});
  double energy = tissue_scale_ * tissue_energy().at(upright.depth_mm, upright.angle_rad).value;
  if (parameters_.inclusion) {
    const Polar over = polar(tip_mm, parameters_.inclusion->axis);
    energy += excess_scale_ * excess_.at(over.depth_mm, over.angle_rad).value;
  }
  return energy;
}

Vector3 PhantomBody::inclusion_mm(const Vector3& tip_mm) const noexcept {
  if (!parameters_.inclusion) return {};
  const Vector3& axis = parameters_.inclusion->axis;
  const Polar at = polar(tip_mm, axis);
  if (at.depth_mm <= 0.0) return {};
  const Vector3 across = at.out - axis * dot(at.out, axis);
  const double sine = size_of(across);
  const Vector3 side = sine > 1e-9 ? across * (1.0 / sine) : Vector3{};
  return axis * movement_along_.at(at.depth_mm, at.angle_rad).value +
         side * (at.angle_rad * movement_across_.at(at.depth_mm, at.angle_rad).value);
}

// The tissue's friction on the sphere, seen at the tip: by the principle of virtual work.
Vector3 PhantomBody::internal_friction_n(const Vector3& tip_mm, double excess_n) noexcept {
  const PhantomInclusion& inclusion = *parameters_.inclusion;
  const Vector3 now_mm = inclusion_mm(tip_mm);
  const double level_n = inclusion.internal_friction * excess_n;
  const double stiffness = level_n / inclusion.internal_presliding_mm;
  // A spring that becomes softer keeps its stretch, one that becomes stiffer its force.
  if (stiffness < friction_stiffness_n_per_mm_) {
    friction_n_ = friction_n_ * (stiffness / friction_stiffness_n_per_mm_);
  }
  friction_stiffness_n_per_mm_ = stiffness;
  friction_n_ = friction_n_ - (now_mm - last_inclusion_mm_) * stiffness;
  last_inclusion_mm_ = now_mm;
  const double size_n = size_of(friction_n_);
  if (size_n > level_n) friction_n_ = friction_n_ * (level_n / size_n);
  const auto share = [&](const Vector3& direction) {
    const Vector3 slope =
        (inclusion_mm(tip_mm + direction * kMovementStepMm) - now_mm) * (1.0 / kMovementStepMm);
    return dot(slope, friction_n_);
  };
  return {share({1.0, 0.0, 0.0}), share({0.0, 1.0, 0.0}), share({0.0, 0.0, 1.0})};
}

PhantomBody::Step PhantomBody::advance(const Vector3& free_mm, double compliance_mm_per_n) noexcept {
  const Polar upright = polar(free_mm, {0.0, 0.0, 1.0});
  Step step;
  step.depth_mm = upright.depth_mm;
  const bool inside = upright.depth_mm > 0.0;
  Vector3 elastic_n;
  Vector3 excess;
  if (inside) {
    excess = excess_n(free_mm);
    elastic_n = gradient_force_n(tissue_energy(), upright) * tissue_scale_ + excess;
    // What a newton holds back is less than a thousandth of a millimetre: one step of Newton's method.
    const double stiffness =
        tissue_scale_ * tissue_energy().at(upright.depth_mm, upright.angle_rad).by_depth_twice;
    elastic_n = elastic_n * (1.0 / (1.0 + std::max(0.0, stiffness) * compliance_mm_per_n));
  }
  const Vector3 change = elastic_n - elastic_n_;
  elastic_n_ = elastic_n;
  Vector3 force_n = elastic_n;
  for (std::size_t i = 0; i < branch_n_.size(); ++i) {
    branch_n_[i] = branch_n_[i] * decay_[i] + change * gain_[i];
    force_n = force_n + branch_n_[i];
  }
  if (!inside) {
    last_inclusion_mm_ = friction_n_ = {};
    friction_stiffness_n_per_mm_ = 0.0;
    return step;
  }
  if (parameters_.inclusion) {
    force_n = force_n + internal_friction_n(free_mm, size_of(excess));
    step.inclusion_mm = last_inclusion_mm_;
  }
  // The surface does not pull: a tip that leaves faster than it recovers is free.
  if (dot(force_n, upright.out) > 0.0) {
    step.force_n = force_n;
    step.depth_mm -= compliance_mm_per_n * dot(force_n, upright.out);
  }
  return step;
}

}  // namespace hapticd::sim
