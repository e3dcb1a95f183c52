#include "rt/baseline/published_direction.h"

#include "rt/friction/dahl.h"

namespace hapticd::rt {

PublishedDirection::PublishedDirection(FrictionLaw law, const FrictionParameters& friction,
                                       double rate_hz) noexcept
    : law_(law), friction_(friction), filter_(kCutoffHz, rate_hz) {
  if (law == FrictionLaw::kDahl && friction.maxwell_slip) maxwell_slip_.emplace(*friction.maxwell_slip);
}

void PublishedDirection::begin(const hal::Vector3& reaction_n) noexcept {
  normal_ = direction_or(reaction_n, normal_);
  filter_.seed(normal_);
  tangent_ = {};
  built_up_ = 0.0;
  if (maxwell_slip_) maxwell_slip_->release();
  friction_n_ = {};
}

void PublishedDirection::update(const hal::Vector3& reaction_n, const hal::Vector3& step_mm,
                                const hal::Vector3& velocity_mm_per_s, double periods) noexcept {
  const hal::Vector3 slide_mm = across(step_mm, normal_);  // (4.17), (4.18)
  const double path_mm = norm(slide_mm);
  if (path_mm > 1e-9) {
    const hal::Vector3 tangent = slide_mm * (1.0 / path_mm);  // (4.19)
    // What had built up along the old direction is worth this much along the new one.
    built_up_ =
        dahl_step(built_up_ * dot(tangent_, tangent), path_mm, friction_.presliding_mm, friction_.exponent);
    tangent_ = tangent;
  }
  const double normal_n = dot(reaction_n, normal_);  // (4.20)
  const double sliding_mm_per_s = dot(velocity_mm_per_s, tangent_);
  const double viscous = friction_.viscous_n_s_per_mm * sliding_mm_per_s;
  if (maxwell_slip_) {
    friction_n_ = (maxwell_slip_->step(slide_mm, normal_) * normal_n + tangent_ * viscous) * -1.0;
  } else {
    const double share = law_ == FrictionLaw::kDahl ? built_up_ : 1.0;
    friction_n_ = tangent_ * -(friction_.kinetic * normal_n * share + viscous);  // (4.16)
  }
  const hal::Vector3 raw = direction_or(reaction_n - friction_n_, normal_);  // (4.10)
  normal_ = direction_or(filter_.update(raw, periods), normal_);
}

}  // namespace hapticd::rt
