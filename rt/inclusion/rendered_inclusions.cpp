#include "rt/inclusion/rendered_inclusions.h"

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {

constexpr double kStepMm = 1e-3;  // for the slope of the movement

}  // namespace

RenderedInclusions::RenderedInclusions(const std::vector<InclusionParameters>& inclusions) {
  for (const InclusionParameters& parameters : inclusions) all_.push_back({parameters, {}, {}, 0.0});
  reset();
}

void RenderedInclusions::reset() noexcept {
  for (One& one : all_) {
    one.moved_mm = one.friction_n = {};
    one.friction_stiffness_n_per_mm = 0.0;
  }
  strongest_ = 0;
  force_n_ = {};
  if (!all_.empty()) strongest_place_mm_ = all_.front().parameters.place_mm;
}

// Dry friction between sphere and tissue, a spring that slips at its limit, acts on the movement of the
// sphere; the tip meets it by the principle of virtual work. A spring that becomes stiffer under load keeps
// its force, one that becomes softer its stretch: no energy is made.
hal::Vector3 RenderedInclusions::internal_friction_n(One& one, const Indentation& at,
                                                     double added_n) noexcept {
  const InclusionParameters& p = one.parameters;
  const double level_n = p.internal_friction * added_n;
  const double stiffness = level_n / p.internal_presliding_mm;
  if (stiffness < one.friction_stiffness_n_per_mm)
    one.friction_n = one.friction_n * (stiffness / one.friction_stiffness_n_per_mm);
  one.friction_stiffness_n_per_mm = stiffness;
  const hal::Vector3 now_mm = movement_mm(p, at);
  one.friction_n = one.friction_n - (now_mm - one.moved_mm) * stiffness;
  const double size_n = norm(one.friction_n);
  if (size_n > level_n) one.friction_n = one.friction_n * (level_n / size_n);
  // A tip that moves along the normal presses deeper; across it, it takes the surface point along.
  const auto share = [&](const hal::Vector3& direction) {
    Indentation there = at;
    there.tip_mm = there.tip_mm + direction * kStepMm;
    there.displacement_mm -= kStepMm * dot(direction, at.normal);
    return dot(movement_mm(p, there) - now_mm, one.friction_n) / kStepMm;
  };
  return {share({1.0, 0.0, 0.0}), share({0.0, 1.0, 0.0}), share({0.0, 0.0, 1.0})};
}

hal::Vector3 RenderedInclusions::update(const Indentation& at) noexcept {
  force_n_ = {};
  double max_n = -1.0;
  const bool pressed = at.displacement_mm > 0.0;
  for (std::size_t i = 0; i < all_.size(); ++i) {
    One& one = all_[i];
    hal::Vector3 force_n;
    if (pressed) {
      const bool published = one.parameters.variant == InclusionVariant::kPublished;
      force_n = published ? published_force_n(one.parameters, at) : energy_force_n(one.parameters, at);
      const double added_n = norm(force_n);
      if (!published && one.parameters.internal_friction > 0.0) {
        force_n = force_n + internal_friction_n(one, at, added_n);
      }
      one.moved_mm = movement_mm(one.parameters, at);
    } else {
      one.moved_mm = one.friction_n = {};
      one.friction_stiffness_n_per_mm = 0.0;
    }
    const double size_n = norm(force_n);
    if (size_n > max_n) {
      max_n = size_n;
      strongest_ = i;
      strongest_place_mm_ = one.parameters.place_mm + one.moved_mm;
    }
    force_n_ = force_n_ + force_n;
  }
  return force_n_;
}

}  // namespace hapticd::rt
