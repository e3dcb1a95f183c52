#include "rt/scene/renderer.h"

#include <algorithm>
#include <utility>

#include "rt/record/reuse_record.h"

namespace hapticd::rt {

namespace {

/// Part of the guard's force that is the pipeline's: the assistance has gone through in the same share as the
/// whole.
hal::Vector3 of_pipeline(const hal::Vector3& force_n, const hal::Vector3& wanted_n,
                         const hal::Vector3& assistance_n) noexcept {
  const double wanted_squared = dot(wanted_n, wanted_n);
  if (!(wanted_squared > 0.0) || dot(assistance_n, assistance_n) == 0.0) return force_n;
  return force_n - assistance_n * std::clamp(dot(force_n, wanted_n) / wanted_squared, 0.0, 1.0);
}

}  // namespace

Pipeline* Renderer::exchange(Pipeline* next, const GuardLimits& limits, const AssistanceSpec& spec) noexcept {
  Pipeline* before = pipeline_;
  pipeline_ = next;
  channels_ = next != nullptr ? next->channels() : 0;
  ++generation_;
  pipeline_is_stale_ = true;
  hand_over_n_ = of_pipeline(guard_.force_n(), guard_.wanted_n(), assistance_.force_n());
  hand_over_s_ = limits.renders_real_object ? kHandOverS : kUnwatchedHandOverS;
  hand_over_share_ = next != nullptr && dot(hand_over_n_, hand_over_n_) > 0.0 ? 1.0 : 0.0;
  guard_.set_limits(limits);
  assistance_.exchange(spec, next != nullptr);
  if (before != nullptr && (before->channels() & channel::kZero) != 0) zero_ = before->zero();
  if (next != nullptr) next->adopt_zero(zero_);
  noticed_ = next != nullptr ? next->faults() : 0;
  return before;
}

void Renderer::set_target(const TargetLaw& target, double ramp_s) noexcept {
  if (pipeline_ != nullptr) pipeline_->set_target(target, ramp_s);
}

void Renderer::watch_bias(const hal::RigSample& sample) noexcept {
  const bool changed = has_bias_serial_ && sample.bias_serial != bias_serial_;
  has_bias_serial_ = true;
  bias_serial_ = sample.bias_serial;
  // A driver that lost its zero changes the number as well, and warns.
  const bool lost = (sample.status & hal::sample_status::kForceWarning) != 0;
  if (changed && !lost && pipeline_ != nullptr) pipeline_->biased_at(sample.tip_orientation);
}

inline PipelineOutput Renderer::evaluate(const hal::RigSample& sample, bool is_evaluated,
                                         bool has_jump) noexcept {
  if (!is_evaluated) return {};
  if (pipeline_is_stale_) {
    pipeline_->reset();
    pipeline_is_stale_ = false;
  }
  // After a jump the guard waits alone: its size is known, so what the pipeline has of a contact stays true.
  const LoadMonitor& load = guard_.load();
  if (guard_.watches_load() && load.is_waiting() && !load.has_jumped()) pipeline_->distrust_sensor();
  if (load.found_count() != found_count_) [[unlikely]] {
    // The guard has just found the whole zero. A part of it may have been followed by the pipeline already.
    found_count_ = load.found_count();
    FollowedZero zero = pipeline_->zero();
    zero.force.shift(load.drift_n() - zero.force.value_n());
    pipeline_->adopt_zero(zero);
  }
  if (!has_jump) return pipeline_->evaluate(sample);
  hal::RigSample without_jump = sample;
  without_jump.sensor_force_n = sample.sensor_force_n - load.jump_n();
  return pipeline_->evaluate(without_jump);
}

inline void Renderer::fill_record(const hal::RigSample& sample, bool is_evaluated, bool has_jump,
                                  bool assists, TickRecord& record) const noexcept {
  const std::uint32_t generation = pipeline_ != nullptr ? generation_ : 0;
  const std::uint32_t channels = channel::kSample | channel::kGuard |
                                 (sample.angles.known ? channel::kAngles : 0U) |
                                 (assists ? channel::kAssist : 0U) | (is_evaluated ? channels_ : 0U);
  reuse(record, channels, generation);
  record.tick = sample.tick;
  record.time_ns = sample.time_ns;
  record.tip_position_mm = sample.tip_position_mm;
  record.tip_orientation = sample.tip_orientation;
  if (sample.angles.known) record.angles = sample.angles;
  record.sensor_force_n = sample.sensor_force_n;
  record.sensor_torque_n_mm = sample.sensor_torque_n_mm;
  record.sample_status = sample.status;
  record.force_count = sample.force_count;
  record.force_age_ns = sample.force_age_ns;
  record.bias_serial = sample.bias_serial;
  record.position_age_ns = sample.position_age_ns;
  if (!is_evaluated) return;
  pipeline_->fill_record(record);
  if (!guard_.watches_load()) return;
  const LoadMonitor& load = guard_.load();
  record.jump_n = load.jump_n();
  record.jump_count = load.jump_count();
  record.last_jump_n = load.last_jump_n();
  // The pipeline follows the zero of a sensor without the jump.
  if (has_jump) record.zero.force_n = pipeline_->zero().force.value_n() + load.jump_n();
}

[[gnu::flatten]] hal::DeviceCommand Renderer::tick(const hal::RigSample& sample,
                                                   TickRecord& record) noexcept {
  watch_bias(sample);
  Admission admission = guard_.admit(sample, noticed_);
  if (admission.restarts()) pipeline_is_stale_ = true;
  const bool is_evaluated = admission.is_fit() && pipeline_ != nullptr;
  const hal::Vector3& jump_n = guard_.load().jump_n();
  const bool has_jump = guard_.watches_load() && dot(jump_n, jump_n) != 0.0;
  const PipelineOutput output = evaluate(sample, is_evaluated, has_jump);
  if (is_evaluated) noticed_ = output.faults;
  const bool assists = !assistance_.is_idle();
  fill_record(sample, is_evaluated, has_jump, assists, record);
  const bool is_free = !output.in_contact && !output.wants_force;
  // A missing tick does not count as time in which it was seen free.
  free_s_ = is_free ? std::min(free_s_ + std::min(guard_.interval_s(), period_s_), kFreeS) : 0.0;
  const double interval_s = guard_.rise_interval_s();
  hal::Vector3 assistance_n;
  if (assists) assistance_n = assistance_.update(sample, output.touch, !guard_.force_is_zero(), interval_s);
  hal::Vector3 wanted_n = output.force_n;
  if (hand_over_share_ > 0.0) {
    hand_over_share_ =
        guard_.force_is_zero() ? 0.0 : std::max(0.0, hand_over_share_ - interval_s / hand_over_s_);
    wanted_n = hand_over_n_ * hand_over_share_ + wanted_n * (1.0 - hand_over_share_);
  }
  const hal::DeviceCommand command{
      guard_.release(std::move(admission), wanted_n, output.held_back, assistance_n)};
  guard_.fill_record(record);
  if (assists) {
    assistance_.observe({.tick = sample.tick,
                         .tip_mm = sample.tip_position_mm,
                         .reaction_n = output.touch.reaction_n,
                         .displacement_mm = output.touch.displacement_mm,
                         .is_held_back = guard_.state() != GuardState::kRendering,
                         .is_limited = guard_.limited() != 0},
                        guard_.interval_s());
    assistance_.fill_record(record);
  }
  if (pipeline_ == nullptr) return command;
  pipeline_->applied(assists ? of_pipeline(command.force_n, guard_.wanted_n(), assistance_n)
                             : command.force_n);
  return command;
}

}  // namespace hapticd::rt
