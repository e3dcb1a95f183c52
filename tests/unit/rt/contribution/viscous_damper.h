#pragma once

#include "rt/contribution/contribution.h"

namespace hapticd::rt {

/// An object that feels as if it lay in oil: a force against the motion of the tip while it touches.
class ViscousDamper final : public Contribution {
 public:
  explicit ViscousDamper(double damping_n_s_per_mm) noexcept : damping_n_s_per_mm_(damping_n_s_per_mm) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    if (!now.is_rendered) return {};
    return now.tool.velocity_mm_per_s * -damping_n_s_per_mm_;
  }
  void reset() noexcept override {}  // it remembers nothing

 private:
  double damping_n_s_per_mm_;
};

}  // namespace hapticd::rt
