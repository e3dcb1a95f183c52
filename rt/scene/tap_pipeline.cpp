#include "rt/scene/tap_pipeline.h"

#include <algorithm>
#include <cmath>

#include "rt/scene/fill_contact.h"
#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {

TapPipeline::TapPipeline(const SceneSpec& resolved, const hal::RigInfo& rig)
    : axis_(resolved.press_axis),
      tool_mass_g_(resolved.tool_mass_g),
      structural_n_per_mm_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0),
      structural_field_(resolved.structural_compensation ? resolved.structural_field : std::nullopt),
      reach_(device_reach(resolved.guard.max_force_n, rig)),
      timer_(rig.rate_hz),
      motion_(rig.device.position_resolution_mm, rig.rate_hz),
      zero_(resolved.contact.zero_bound_n),
      looks_back_(resolved.contact.method == ContactMethod::kMatchedInertia),
      contact_(resolved.contact, resolved.tool_mass_g, rig.rate_hz),
      target_(resolved.target.stiffness_n_per_mm, rig.rate_hz),
      controller_(resolved.controller, rig.rate_hz) {}

std::uint32_t TapPipeline::channels() const noexcept {
  return channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget | channel::kControl |
         channel::kZero;
}

void TapPipeline::reset() noexcept {
  timer_.reset();
  motion_.reset();
  contact_.reset();
  controller_.reset();
  fade_.reset();
}

void TapPipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target.stiffness_n_per_mm, ramp_s);
}

void TapPipeline::applied(const hal::Vector3& force_n) noexcept {
  controller_.applied(axis_.along_axis_n(force_n));
}

TapPipeline::Measured TapPipeline::measure(const hal::RigSample& sample) noexcept {
  // What was free under another zero may be a load under this one.
  if (zero_.take_bias(sample.bias_serial)) contact_.await_free();
  const std::int64_t position_ns = sample.time_ns - sample.position_age_ns;
  Measured now;
  now.interval = timer_.update(position_ns);
  now.depth_mm = axis_.depth_mm(sample.tip_position_mm);
  if (structural_field_) structural_n_per_mm_ = structural_field_->stiffness_at(sample.tip_position_mm);
  motion_.update(now.depth_mm, position_ns);
  now.sensor_n = axis_.reaction_n(sample.sensor_force_n - zero_.zero().force_n);
  now.reaction_n = reaction_force_n(now.sensor_n, tool_mass_g_, motion_.acceleration_mm_per_s2());
  return now;
}

void TapPipeline::update_contact(const hal::RigSample& sample, const Measured& now) noexcept {
  ContactStage::Input input;
  input.interval = now.interval;
  input.free_motion = {now.sensor_n, now.depth_mm, sample.time_ns - sample.position_age_ns,
                       sample.time_ns - sample.force_mean_age_ns};
  input.tip_mm = now.depth_mm;
  input.reaction_n = std::abs(now.reaction_n);
  input.depth_mm = now.depth_mm;
  input.contact_depth_mm = contact_depth_mm_;
  input.acceleration_mm_per_s2 = std::abs(motion_.acceleration_mm_per_s2());
  contact_.detect(input);
  if (contact_.detector().just_declared())
    contact_depth_mm_ = looks_back_ ? contact_.onset_mm() : now.depth_mm;
  if (contact_.in_contact()) {
    const double path_mm = now.depth_mm - contact_depth_mm_;
    const double bent_mm =
        structural_n_per_mm_ > 0.0 ? controller_.device_force_n() / structural_n_per_mm_ : 0.0;
    contact_.judge(
        {now.reaction_n, path_mm - bent_mm, path_mm, input.acceleration_mm_per_s2, std::abs(bent_mm)},
        now.interval);
  }
  follow_zero(sample, now.interval);
}

void TapPipeline::follow_zero(const hal::RigSample& sample, const TickInterval& interval) noexcept {
  if (!contact_.zero_shows()) return;
  // Along the axis what the tool's inertia leaves unexplained; across it the inertia averages out.
  const hal::Vector3 read_n = sample.sensor_force_n - zero_.zero().force_n;
  const hal::Vector3 error_n =
      read_n + axis_.device_force_n(axis_.reaction_n(read_n) - contact_.residual_n());
  zero_.update({error_n, sample.sensor_torque_n_mm - zero_.zero().torque_n_mm}, interval);
}

bool TapPipeline::hold_within_sensor(DesiredForce& desired, double encoder_mm) const noexcept {
  // Where the device has less than that, the guard bounds it. NaN is the guard's to see.
  if (reach_.pull_n == reach_.push_n || !(desired.force_n > reach_.pull_n)) return false;
  desired.force_n = reach_.pull_n;
  if (structural_n_per_mm_ > 0.0) {
    desired.displacement_mm = std::max(0.0, encoder_mm - reach_.pull_n / structural_n_per_mm_);
  }
  return true;
}

hal::Vector3 TapPipeline::evaluate(const hal::RigSample& sample, TickRecord& record) noexcept {
  const Measured now = measure(sample);
  update_contact(sample, now);
  const bool in_contact = contact_.in_contact();

  const double target = target_.update(now.interval.periods);
  DesiredForce desired;
  if (in_contact) {
    const double encoder_mm = now.depth_mm - contact_depth_mm_;
    // a (f_r - k~ x): what the evidence allows of (3.3), solved as one where the device bends.
    const double share = contact_.authority();
    desired = structural_n_per_mm_ > 0.0
                  ? desired_force_compensated(share * now.reaction_n, share * target, encoder_mm,
                                              structural_n_per_mm_)
                  : desired_force_rigid(share * now.reaction_n, share * target, encoder_mm);
    if (hold_within_sensor(desired, encoder_mm)) record.guard_limits |= guard_limit::kForce;
  }
  desired.force_n = fade_.update(in_contact, desired.force_n, now.interval);
  const double device_force_n = controller_.device_force_n();
  const double command_n = controller_.update(desired.force_n);

  record.velocity_mm_per_s = motion_.velocity_mm_per_s();
  record.acceleration_mm_per_s2 = motion_.acceleration_mm_per_s2();
  record.reaction_force_n = now.reaction_n;
  fill_contact(contact_, record);
  record.zero = zero_.zero();
  record.displacement_mm = desired.displacement_mm;
  record.target_stiffness_n_per_mm = target;
  record.desired_force_n = desired.force_n;
  record.commanded_force_n = command_n;
  if (in_contact) {
    record.hand_force_n = now.reaction_n - device_force_n;  // (3.1)
    if (desired.displacement_mm > 0.0) {
      const FeasibleRange range =
          feasible_range(now.reaction_n / desired.displacement_mm, record.hand_force_n, reach_);
      record.feasible_min_n_per_mm = range.min_n_per_mm;
      record.feasible_max_n_per_mm = range.max_n_per_mm;
    }
  }
  return axis_.device_force_n(command_n);
}

}  // namespace hapticd::rt
