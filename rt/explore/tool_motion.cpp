#include "rt/explore/tool_motion.h"

#include <utility>

#include "rt/signal/vector.h"

namespace hapticd::rt {

ToolMotion::ToolMotion(const Parts& parts) noexcept
    : load_(parts.load),
      zero_(parts.zero_bound_n),
      timer_(parts.rate_hz),
      motion_(parts.position_resolution_mm, parts.rate_hz),
      deflection_(parts.deflection),
      structural_field_(parts.structural_field) {
  if (parts.mass_is_off_tip) mass_motion_.emplace(parts.position_resolution_mm, parts.rate_hz);
}

void ToolMotion::reset() noexcept {
  timer_.reset();
  deflection_.reset();
  has_tip_ = false;
}

const ToolState& ToolMotion::update(const hal::RigSample& sample, const hal::Vector3& device_n) noexcept {
  const hal::Vector3& encoder_mm = sample.tip_position_mm;
  const TickInterval interval = timer_.update(sample.time_ns - sample.position_age_ns);
  motion_.update(encoder_mm, interval);
  if (structural_field_) deflection_.set_stiffness_n_per_mm(structural_field_->stiffness_at(encoder_mm));
  const hal::Vector3 tip_mm = encoder_mm - deflection_.update(device_n, interval.periods);
  hal::Vector3 mass_mm = encoder_mm;
  if (mass_motion_) {
    mass_mm = load_.centre_mm(encoder_mm, sample.tip_orientation);
    mass_motion_->update(mass_mm, interval);
  }
  const hal::Vector3 acceleration = motion_.acceleration_mm_per_s2();
  const hal::Vector3 mass_acceleration = mass_motion_ ? mass_motion_->acceleration_mm_per_s2() : acceleration;
  const hal::Vector3 load_n =
      load_.without_weight_n(sample.sensor_force_n - zero_.force_n(), sample.tip_orientation);
  if (!std::exchange(has_tip_, true)) {
    last_tip_mm_ = tip_mm;
    last_encoder_mm_ = encoder_mm;
  }
  state_.interval = interval;
  state_.encoder_mm = encoder_mm;
  state_.encoder_step_mm = encoder_mm - std::exchange(last_encoder_mm_, encoder_mm);
  state_.tip_mm = tip_mm;
  state_.step_mm = tip_mm - std::exchange(last_tip_mm_, tip_mm);
  state_.velocity_mm_per_s = motion_.velocity_mm_per_s();
  state_.acceleration_mm_per_s2 = acceleration;
  state_.mass_mm = mass_mm;
  state_.mass_acceleration_mm_per_s2 = mass_acceleration;
  state_.load_n = load_n;
  state_.reaction_n = load_n + load_.inertia_n(mass_acceleration);
  return state_;
}

void ToolMotion::follow_zero(const hal::RigSample& sample, const ContactStage3& contact,
                             const TickInterval& interval) noexcept {
  if (!zero_.is_followed()) return;
  zero_.drift_on(interval);
  const bool shows_in_motion = contact.zero_shows_in_motion();
  if (!shows_in_motion && !contact.zero_shows()) return;
  const SensorZero error{load_.in_sensor_frame(contact.residual_n() * -1.0, sample.tip_orientation),
                         sample.sensor_torque_n_mm - zero_.torque_n_mm()};
  if (!shows_in_motion) return zero_.update(error, norm(state_.velocity_mm_per_s), interval);
  zero_.take_over(error, ReadingInMotion3::kTakeOverNPerS, interval);
}

}  // namespace hapticd::rt
