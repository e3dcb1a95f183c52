#include "rt/scene/explore_pipeline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rt/scene/explore_parts.h"
#include "rt/scene/fill_contact.h"
#include "rt/target/feasible_range.h"

namespace hapticd::rt {

namespace {

std::uint32_t channels_of(const SceneSpec& spec) noexcept {
  std::uint32_t all = channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget |
                      channel::kControl | channel::kDirection | channel::kZero;
  if (spec.explore.displacement == DisplacementEstimator::kFused) all |= channel::kFusion;
  return all;
}

}  // namespace

ExplorePipeline::ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig,
                                 Contributions contributions)
    : reach_(device_reach(resolved.guard.max_force_n, rig)),
      motion_(tool_motion_of(resolved, rig)),
      contact_(explored_contact_of(resolved, model, rig.rate_hz)),
      release_(resolved.explore.release == ReleaseMethod::kCut),
      stiffness_(stiffness_force_of(resolved, rig.rate_hz)),
      contributions_(std::move(contributions)),
      controller_(resolved.controller, rig.rate_hz),
      back_drive_(resolved.compensation.back_drive ? rig.device.coulomb_friction_n : 0.0),
      end_(resolved.guard.max_force_n),
      channels_(channels_of(resolved) | contributions_.channels) {}

void ExplorePipeline::reset() noexcept {
  motion_.reset();
  now_.reset();
  contact_.reset();
  release_.reset();
  stiffness_.reset();
  for (const auto& contribution : contributions_.desired) contribution->reset();
  for (const auto& contribution : contributions_.direct) contribution->reset();
  controller_.reset();
  back_drive_.reset();
  end_.reset();
  back_drive_direction_n_ = past_controller_n_ = command_n_ = {};
}

void ExplorePipeline::applied(const hal::Vector3& force_n) noexcept {
  // The rest moves the motors. What the guard held back, it held back of both.
  const double wanted = dot(command_n_, command_n_);
  const double passed = wanted > 0.0 ? std::clamp(dot(force_n, command_n_) / wanted, 0.0, 1.0) : 0.0;
  controller_.applied(force_n - past_controller_n_ * passed);
}

[[gnu::flatten]] PipelineOutput ExplorePipeline::evaluate(const hal::RigSample& sample) noexcept {
  // What was free under another zero may be a load under this one.
  if (motion_.take_bias(sample)) contact_.stage().await_free();
  // The observer's f_d is the last tick's until the new command is applied.
  const hal::Vector3 device_n = controller_.device_force_n();
  ContactState& now = now_.emplace(motion_.update(sample, device_n), device_n);
  contact_.update(sample, now);
  motion_.follow_zero(sample, contact_.stage(), now.tool.interval);
  release_.update(now.in_contact, contact_.stage().authority(), contact_.displacement_mm(),
                  now.tool.interval);
  now.is_rendered = release_.is_rendered();
  now.authority = release_.authority();
  now.displacement_mm = release_.displacement_mm();
  const double compensated = stiffness_.predict(now);
  hal::Vector3 desired_n = desired_force(now);
  const bool is_held = hold_within_sensor(now.normal, desired_n);
  command_n_ = end_.update(now.in_contact, command(now, desired_n, compensated), now.tool.interval);
  inward_n_ = -dot(desired_n, now.normal);
  return {command_n_,
          now.in_contact,
          std::abs(inward_n_) >= kTraceN,
          is_held ? guard_limit::kForce : std::uint8_t{0},
          touch_of(contact_.stage(), now.normal_n, now.in_contact ? now.displacement_mm : 0.0),
          faults()};
}

inline hal::Vector3 ExplorePipeline::desired_force(const ContactState& now) noexcept {
  hal::Vector3 desired_n = stiffness_.update(now, release_);
  for (const auto& contribution : contributions_.desired) {
    desired_n = desired_n + contribution->update(now) * now.authority;
  }
  stiffness_.hold_within(contact_.stage().max_force_n(), now, desired_n);
  return desired_n;
}

inline bool ExplorePipeline::hold_within_sensor(const hal::Vector3& normal,
                                                hal::Vector3& desired_n) const noexcept {
  // A device that has less than that is bounded by the guard. NaN is the guard's to see.
  const double pull_n = -dot(desired_n, normal);
  if (reach_.pull_n == reach_.push_n || !(pull_n > reach_.pull_n)) return false;
  desired_n = desired_n + normal * (pull_n - reach_.pull_n);
  return true;
}

inline hal::Vector3 ExplorePipeline::command(const ContactState& now, const hal::Vector3& desired_n,
                                             double compensated) noexcept {
  if (back_drive_.is_on()) back_drive_direction_n_ = back_drive_.update(now.tool.encoder_step_mm);
  past_controller_n_ = back_drive_direction_n_ * (now.authority * compensated * stiffness_.rendered_share());
  hal::Vector3 command_n = controller_.update(desired_n) + past_controller_n_;
  for (const auto& contribution : contributions_.direct) {
    const hal::Vector3 force_n = contribution->update(now);
    past_controller_n_ = past_controller_n_ + force_n;
    command_n = command_n + force_n;
  }
  return command_n;
}

[[gnu::flatten]] void ExplorePipeline::fill_record(TickRecord& record) const noexcept {
  if (!now_) return;
  const ContactState& now = *now_;
  record.velocity_mm_per_s = now.rate_mm_per_s;
  record.acceleration_mm_per_s2 = -dot(now.tool.acceleration_mm_per_s2, now.normal);
  fill_contact(contact_.stage(), record);
  contact_.fill_record(now, record);
  for (const auto& contribution : contributions_.desired) contribution->fill_record(now, record);
  for (const auto& contribution : contributions_.direct) contribution->fill_record(now, record);
  record.zero = motion_.zero().zero();
  record.desired_force_n = inward_n_;
  record.commanded_force_n = -dot(command_n_, now.normal);
  record.target_stiffness_n_per_mm = stiffness_.target_n_per_mm();
  record.hand_force_n = record.feasible_min_n_per_mm = record.feasible_max_n_per_mm = 0.0;
  if (!now.in_contact) return;
  const double hand_n = now.hand_n();
  record.hand_force_n = hand_n;
  if (now.displacement_mm > 0.0) {
    const FeasibleRange range = feasible_range(now.normal_n / now.displacement_mm, hand_n, reach_);
    record.feasible_min_n_per_mm = range.min_n_per_mm;
    record.feasible_max_n_per_mm = range.max_n_per_mm;
  }
}

}  // namespace hapticd::rt
