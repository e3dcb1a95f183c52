#include "rt/scene/tap_pipeline.h"

#include <algorithm>

#include "rt/signal/tool_compensation.h"
#include "rt/target/largest_pull.h"

namespace hapticd::rt {

TapPipeline::TapPipeline(const SceneSpec& resolved, const hal::RigInfo& rig)
    : axis_(resolved.press_axis),
      tool_mass_g_(resolved.tool_mass_g),
      structural_n_per_mm_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0),
      reach_{std::min(resolved.guard.max_force_n, pull_within_sensor_n(rig)), resolved.guard.max_force_n},
      motion_(rig.device.position_resolution_mm, rig.rate_hz),
      contact_parameters_(resolved.contact),
      residual_(resolved.tool_mass_g, rig.rate_hz),
      contact_(resolved.contact, rig.rate_hz),
      onset_(rig.rate_hz),
      target_(resolved.target.stiffness_n_per_mm, rig.rate_hz),
      controller_(resolved.controller, rig.rate_hz),
      fade_(rig.rate_hz) {}

std::uint32_t TapPipeline::channels() const noexcept {
  return channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget | channel::kControl;
}

void TapPipeline::reset() noexcept {
  motion_.reset();
  residual_.reset();
  contact_.reset();
  onset_.forget();
  controller_.reset();
  fade_.reset();
}

void TapPipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target.stiffness_n_per_mm, ramp_s);
}

void TapPipeline::applied(const hal::Vector3& force_n) noexcept {
  controller_.applied(axis_.along_axis_n(force_n));
}

bool TapPipeline::update_contact(double sensor_n, double reaction_n, double depth_mm,
                                 std::int64_t time_ns) noexcept {
  if (contact_parameters_.method == ContactMethod::kFilteredAcceleration) {
    const bool in_contact = contact_.update(reaction_n, depth_mm, contact_depth_mm_);
    if (contact_.just_declared()) contact_depth_mm_ = depth_mm;
    return in_contact;
  }
  const double residual_n = residual_.update(sensor_n, depth_mm, time_ns, contact_.in_contact());
  onset_.remember(depth_mm, residual_.prompt_force_n());
  const bool in_contact = contact_.update(residual_n, depth_mm, contact_depth_mm_);
  if (contact_.just_declared()) {
    contact_depth_mm_ = onset_.place_mm(contact_parameters_.release_ratio * contact_parameters_.threshold_n +
                                        residual_.seen_jerk_n());
  }
  if (contact_.just_left_surface()) residual_.assume_free();
  return in_contact;
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
  const double depth_mm = axis_.depth_mm(sample.tip_position_mm);
  motion_.update(depth_mm, sample.time_ns);
  const double sensor_n = axis_.reaction_n(sample.sensor_force_n);
  const double reaction_n = reaction_force_n(sensor_n, tool_mass_g_, motion_.acceleration_mm_per_s2());
  const bool in_contact = update_contact(sensor_n, reaction_n, depth_mm, sample.time_ns);

  const double target = target_.update();
  DesiredForce desired;
  if (in_contact) {
    const double encoder_mm = depth_mm - contact_depth_mm_;
    desired = structural_n_per_mm_ > 0.0
                  ? desired_force_compensated(reaction_n, target, encoder_mm, structural_n_per_mm_)
                  : desired_force_rigid(reaction_n, target, encoder_mm);
    if (hold_within_sensor(desired, encoder_mm)) record.guard_limits |= guard_limit::kForce;
  }
  desired.force_n = fade_.update(in_contact, desired.force_n);
  const double device_force_n = controller_.device_force_n();
  const double command_n = controller_.update(desired.force_n);

  record.velocity_mm_per_s = motion_.velocity_mm_per_s();
  record.acceleration_mm_per_s2 = motion_.acceleration_mm_per_s2();
  record.reaction_force_n = reaction_n;
  record.in_contact = in_contact;
  record.contact_reason = contact_.reason();
  record.contact_count = contact_.count();
  record.displacement_mm = desired.displacement_mm;
  record.target_stiffness_n_per_mm = target;
  record.desired_force_n = desired.force_n;
  record.commanded_force_n = command_n;
  if (in_contact) {
    record.hand_force_n = reaction_n - device_force_n;  // (3.1)
    if (desired.displacement_mm > 0.0) {
      const FeasibleRange range =
          feasible_range(reaction_n / desired.displacement_mm, record.hand_force_n, reach_);
      record.feasible_min_n_per_mm = range.min_n_per_mm;
      record.feasible_max_n_per_mm = range.max_n_per_mm;
    }
  }
  return axis_.device_force_n(command_n);
}

}  // namespace hapticd::rt
