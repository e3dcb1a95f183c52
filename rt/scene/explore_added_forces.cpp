// The forces of what is not there: inclusions, another friction, transients.

#include <algorithm>

#include "rt/scene/explore_pipeline.h"
#include "rt/signal/vector.h"

namespace hapticd::rt {

hal::Vector3 ExplorePipeline::inclusion_force(const Measured& now) noexcept {
  const double rate = rate_mm_per_s(now);
  Indentation at{now.tip_mm, direction_.normal(), 0.0, rate};
  const double share = authority();
  if (share > 0.0) at.displacement_mm = std::max(0.0, rendered_mm_ + lead_now_s_ * rate);
  // The surface point stays where it is while the displacement is taken ahead.
  at.tip_mm = at.tip_mm + at.normal * (rendered_mm_ - at.displacement_mm);
  return inclusions_->update(at) * share;
}

hal::Vector3 ExplorePipeline::friction_force(const Measured& now, double normal_n) noexcept {
  if (!contact_.in_contact()) {
    friction_->rest();
    return {};
  }
  const hal::Vector3& normal = direction_.normal();
  const double hand_normal_n = normal_n + dot(controller_.device_force_n(), normal);
  return friction_->update({normal, direction_.friction_n(), normal_n, hand_normal_n, now.step_mm,
                            now.velocity_mm_per_s, now.interval}) *
         authority();
}

hal::Vector3 ExplorePipeline::transient_force(const Measured& now) noexcept {
  return transient_->update({contact_.in_contact(),
                             contact_.in_contact() && contact_.detector().just_declared(), contact_.earned_authority(),
                             rate_mm_per_s(now), direction_.normal(), now.interval});
}

}  // namespace hapticd::rt
