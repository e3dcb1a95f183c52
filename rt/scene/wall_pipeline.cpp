#include "rt/scene/wall_pipeline.h"

#include <algorithm>
#include <cmath>

#include "rt/target/desired_force.h"

namespace hapticd::rt {

WallPipeline::WallPipeline(const SceneSpec& resolved, const hal::RigInfo& rig)
    : surface_(resolved.press_axis, resolved.wall_position_mm, resolved.wall_ball, resolved.wall_map),
      inward_(resolved.press_axis),
      structural_n_per_mm_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0),
      structural_field_(resolved.structural_compensation ? resolved.structural_field : std::nullopt),
      target_(resolved.target, rig.rate_hz, resolved.max_target_change_n_per_s),
      timer_(rig.rate_hz),
      controller_(resolved.controller, rig.rate_hz) {}

std::uint32_t WallPipeline::channels() const noexcept {
  const std::uint32_t direction = surface_.is_curved() ? channel::kDirection : 0;
  return channel::kContact | channel::kDeformation | channel::kTarget | channel::kControl | direction;
}

void WallPipeline::reset() noexcept {
  reason_ = ContactReason::kAwaitingFree;
  controller_.reset();
  timer_.reset();
}

void WallPipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target, ramp_s);
}

void WallPipeline::applied(const hal::Vector3& force_n) noexcept {
  controller_.applied(dot(inward_, force_n));
}

void WallPipeline::note_onset(const hal::RigSample& sample, double inside_mm, double outside_mm) noexcept {
  const std::int64_t inside_ns = sample.time_ns - sample.position_age_ns;
  const double step_mm = inside_mm - outside_mm;
  const double share = step_mm > 0.0 ? std::clamp(inside_mm / step_mm, 0.0, 1.0) : 0.0;
  const auto past_ns = static_cast<std::int64_t>(share * static_cast<double>(inside_ns - position_ns_));
  onset_ = {inside_ns - past_ns, position_ns_, inside_ns};
}

PipelineOutput WallPipeline::evaluate(const hal::RigSample& sample) noexcept {
  const auto [encoder_mm, inward] = surface_.at(sample.tip_position_mm);
  inward_ = inward;
  const TickInterval interval = timer_.update(sample.time_ns);
  // v += (Δx − v Δt)/(Δt + τ): a count of the encoders moves it by 4 mm/s at most.
  constexpr double kSmoothingS = 7e-3;
  rate_mm_per_s_ = interval.is_gap ? 0.0
                                   : rate_mm_per_s_ + (encoder_mm - depth_mm_ - rate_mm_per_s_ * interval.s) /
                                                          (interval.s + kSmoothingS);
  const double depth_before_mm = depth_mm_;
  depth_mm_ = encoder_mm;

  if (structural_field_) structural_n_per_mm_ = structural_field_->stiffness_at(sample.tip_position_mm);
  // There is no object: only its own force acts, −F(x), on a device that bends at x = x_s + F(x)/k_s (see
  // desired_force_compensated). For F(x) = k~ x with last tick's k~: exact for linear targets; of a power law
  // of exponent m a pole at (m − 1) r/(1 − r) < 0.75 a tick, r = k~/k_s, as m r ≤ 0.8.
  double displacement_mm = encoder_mm;
  if (structural_n_per_mm_ > 0.0 && encoder_mm > 0.0) {
    const double ratio = std::min(target_.stiffness_n_per_mm() / structural_n_per_mm_, kMaxCompensableRatio);
    displacement_mm = encoder_mm / (1.0 - ratio);
  }
  double object_n = 0.0;
  if (displacement_mm > 0.0) {
    object_n = target_.update(displacement_mm, rate_mm_per_s_, sample.tip_position_mm);
  } else {
    target_.rest();
  }
  const bool inside = displacement_mm > 0.0;
  const bool was_inside = in_contact();
  if (inside) {
    // A wall that appears around the tool would throw it out: it acts only after the tool was seen outside.
    if (was_inside) {
      reason_ = ContactReason::kHeld;
    } else if (reason_ != ContactReason::kAwaitingFree) {
      reason_ = ContactReason::kAboveThreshold;
      ++contact_count_;
      note_onset(sample, encoder_mm, depth_before_mm);
    }
  } else {
    reason_ = was_inside ? ContactReason::kAboveSurface : ContactReason::kFree;
  }
  const bool touches = in_contact();
  displacement_mm_ = touches ? displacement_mm : 0.0;
  desired_n_ = touches ? -object_n : 0.0;
  command_n_ = controller_.update(desired_n_);
  position_ns_ = sample.time_ns - sample.position_age_ns;
  return {inward * command_n_,
          touches,
          std::abs(desired_n_) >= kTraceN,
          0,
          {.in_contact = touches, .is_evident = touches, .displacement_mm = displacement_mm_}};
}

void WallPipeline::fill_record(TickRecord& record) const noexcept {
  const bool touches = in_contact();
  record.in_contact = touches;
  record.contact_reason = reason_;
  record.contact_count = contact_count_;
  record.contact_onset = onset_;
  record.contact_authority = touches ? 1.0 : 0.0;  // the wall needs no evidence
  record.displacement_mm = displacement_mm_;
  record.target_stiffness_n_per_mm = target_.stiffness_n_per_mm();
  record.desired_force_n = desired_n_;
  record.commanded_force_n = command_n_;
  record.hand_force_n = -controller_.device_force_n();
  record.normal = touches ? inward_ * -1.0 : hal::Vector3{};
}

}  // namespace hapticd::rt
