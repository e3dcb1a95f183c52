#pragma once

#include "rt/contribution/contribution.h"
#include "rt/control/hand_port_passivity.h"

namespace hapticd::rt {

/// Damping that keeps object and device together from giving the hand energy.
class PassivityForce final : public Contribution {
 public:
  explicit PassivityForce(double rate_hz) noexcept : passivity_(rate_hz) {}

  hal::Vector3 update(const ContactState& now) noexcept override {
    if (now.began) passivity_.begin();
    if (!now.is_rendered) return {};
    return passivity_.update(now.tool.reaction_n, now.device_n, now.tool.step_mm, now.tool.velocity_mm_per_s,
                             now.tool.interval.periods);
  }
  void fill_record(const ContactState& now, TickRecord& record) const noexcept override {
    record.hand_energy_mj = now.in_contact ? passivity_.energy_mj() : 0.0;
    record.passivity_damping_n_s_per_mm = now.in_contact ? passivity_.damping_n_s_per_mm() : 0.0;
  }
  void reset() noexcept override { passivity_.begin(); }

 private:
  HandPortPassivity passivity_;
};

}  // namespace hapticd::rt
