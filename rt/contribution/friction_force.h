#pragma once

#include <algorithm>
#include <cmath>

#include "rt/contribution/contribution.h"
#include "rt/modulation/friction_modulation.h"

namespace hapticd::rt {

/// Force that makes the real friction feel like another.
class FrictionForce final : public Contribution {
 public:
  /// `kinetic`: μ_k as identified, > 0; `max_force_n`: of the device.
  FrictionForce(const FrictionTarget& target, double kinetic, double max_force_n) noexcept
      : friction_(target, kinetic), max_force_n_(max_force_n) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    if (now.in_contact) {
      return friction_.update({now.normal, now.friction_n, now.normal_n, now.hand_n(), now.tool.step_mm,
                               now.tool.velocity_mm_per_s, now.tool.interval});
    }
    friction_.rest();
    return {};
  }
  void fill_record(const ContactState& now, TickRecord& record) const noexcept override {
    record.friction_scale = friction_.scale();
    record.friction_is_bounded = friction_.is_bounded();
    record.friction_added_n = friction_.force_n();
    record.friction_feasible_min = record.friction_feasible_max = 0.0;
    if (!now.in_contact) return;
    // The coefficients that can be reached at this load.
    const double along_n = dot(now.device_n, now.normal);
    const double spare_n = std::sqrt(std::max(0.0, max_force_n_ * max_force_n_ - along_n * along_n));
    const FrictionRange range = feasible_friction(norm(now.friction_n), now.hand_n(), spare_n);
    record.friction_feasible_min = range.min;
    record.friction_feasible_max = range.max;
  }
  void reset() noexcept override { friction_.rest(); }

 private:
  FrictionModulation friction_;
  double max_force_n_;
};

}  // namespace hapticd::rt
