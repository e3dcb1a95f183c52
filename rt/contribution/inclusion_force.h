#pragma once

#include <algorithm>
#include <vector>

#include "rt/contribution/contribution.h"
#include "rt/inclusion/rendered_inclusions.h"

namespace hapticd::rt {

/// Force of stiff spheres that are not there.
class InclusionForce final : public Contribution {
 public:
  explicit InclusionForce(const std::vector<InclusionParameters>& inclusions) : inclusions_(inclusions) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    Indentation at{now.tool.tip_mm, now.normal, 0.0, now.rate_mm_per_s};
    if (now.authority > 0.0) {
      at.displacement_mm = std::max(0.0, now.displacement_mm + now.lead_s * now.rate_mm_per_s);
    }
    // The surface point stays where it is while the displacement is taken ahead.
    at.tip_mm = at.tip_mm + at.normal * (now.displacement_mm - at.displacement_mm);
    return inclusions_.update(at);
  }
  void fill_record(const ContactState& /*now*/, TickRecord& record) const noexcept override {
    record.inclusion = static_cast<std::uint32_t>(inclusions_.strongest());
    record.inclusion_position_mm = inclusions_.strongest_place_mm();
    record.inclusion_force_n = inclusions_.force_n();
  }
  void reset() noexcept override { inclusions_.reset(); }

 private:
  RenderedInclusions inclusions_;
};

}  // namespace hapticd::rt
