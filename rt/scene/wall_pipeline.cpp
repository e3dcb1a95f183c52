#include "rt/scene/wall_pipeline.h"

#include <algorithm>
#include <cmath>

#include "rt/target/desired_force.h"

namespace hapticd::rt {

WallPipeline::WallPipeline(const SceneSpec& resolved, const hal::RigInfo& rig)
    : surface_(resolved.press_axis, resolved.wall_position_mm, resolved.wall_ball),
      inward_(resolved.press_axis),
      structural_n_per_mm_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0),
      structural_field_(resolved.structural_compensation ? resolved.structural_field : std::nullopt),
      target_(resolved.target.stiffness_n_per_mm, rig.rate_hz, resolved.max_target_change_n_per_s),
      controller_(resolved.controller, rig.rate_hz) {}

std::uint32_t WallPipeline::channels() const noexcept {
  const std::uint32_t direction = surface_.is_curved() ? channel::kDirection : 0;
  return channel::kContact | channel::kDeformation | channel::kTarget | channel::kControl | direction;
}

void WallPipeline::reset() noexcept {
  reason_ = ContactReason::kAwaitingFree;
  controller_.reset();
}

void WallPipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target.stiffness_n_per_mm, ramp_s);
}

void WallPipeline::applied(const hal::Vector3& force_n) noexcept {
  controller_.applied(dot(inward_, force_n));
}

PipelineOutput WallPipeline::evaluate(const hal::RigSample& sample, TickRecord& record) noexcept {
  const auto [encoder_mm, inward] = surface_.at(sample.tip_position_mm);
  inward_ = inward;
  const double target = target_.update(1.0, std::max(0.0, encoder_mm));

  if (structural_field_) structural_n_per_mm_ = structural_field_->stiffness_at(sample.tip_position_mm);
  // There is no object: only the wall's own force acts, f~_d = -k~ x.
  const DesiredForce wall = structural_n_per_mm_ > 0.0
                                ? desired_force_compensated(0.0, target, encoder_mm, structural_n_per_mm_)
                                : desired_force_rigid(0.0, target, encoder_mm);
  const bool inside = wall.displacement_mm > 0.0;
  const bool was_inside = reason_ == ContactReason::kAboveThreshold || reason_ == ContactReason::kHeld;
  if (inside) {
    // A wall that appears around the tool would throw it out: it acts only after the tool was seen outside.
    if (was_inside) {
      reason_ = ContactReason::kHeld;
    } else if (reason_ != ContactReason::kAwaitingFree) {
      reason_ = ContactReason::kAboveThreshold;
      ++contact_count_;
    }
  } else {
    reason_ = was_inside ? ContactReason::kAboveSurface : ContactReason::kFree;
  }
  const bool in_contact = inside && reason_ != ContactReason::kAwaitingFree;
  const double desired_n = in_contact ? wall.force_n : 0.0;
  const double device_force_n = controller_.device_force_n();
  const double command_n = controller_.update(desired_n);

  record.in_contact = in_contact;
  record.contact_reason = reason_;
  record.contact_count = contact_count_;
  record.contact_authority = in_contact ? 1.0 : 0.0;  // the wall needs no evidence
  record.displacement_mm = in_contact ? wall.displacement_mm : 0.0;
  record.target_stiffness_n_per_mm = target;
  record.desired_force_n = desired_n;
  record.commanded_force_n = command_n;
  record.hand_force_n = -device_force_n;
  if (in_contact) record.normal = inward * -1.0;
  return {inward * command_n, in_contact, std::abs(desired_n) >= kTraceN, 0};
}

}  // namespace hapticd::rt
