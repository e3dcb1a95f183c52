#include "rt/scene/tap_pipeline.h"

#include <algorithm>
#include <cmath>

#include "rt/control/compensation_fade.h"
#include "rt/control/loop_delay.h"
#include "rt/scene/fill_contact.h"
#include "rt/signal/tool_compensation.h"

namespace hapticd::rt {

namespace {
constexpr double kSurfaceMm = 0.1;  // as deep as the surface is known
constexpr double kLittleN = 0.15;   // a reading that jumps of the zero leave unseen
}  // namespace

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
      target_(resolved.target.stiffness_n_per_mm, rig.rate_hz, resolved.max_target_change_n_per_s),
      controller_(resolved.controller, rig.rate_hz),
      end_(resolved.guard.max_force_n),
      reaction_lead_(resolved.compensation.reaction_lead_share.value_or(0.0) *
                         reaction_delay_s(resolved.controller, rig.rate_hz),
                     rig.rate_hz),
      displacement_lead_s_(resolved.compensation.reaction_lead_share.value_or(0.0) *
                           reaction_delay_s(resolved.controller, rig.rate_hz)),
      back_drive_(resolved.compensation.back_drive ? rig.device.coulomb_friction_n : 0.0) {}

std::uint32_t TapPipeline::channels() const noexcept {
  return channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget | channel::kControl |
         channel::kZero;
}

void TapPipeline::reset() noexcept {
  timer_.reset();
  contact_.reset();
  controller_.reset();
  end_.reset();
  fade_.reset();
  late_.reset();
  reaction_lead_.reset();
  swing_.reset();
  back_drive_.reset();
  has_depth_ = false;
  onset_friction_n_ = back_drive_n_ = command_n_ = displacement_mm_ = 0.0;
}

void TapPipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target.stiffness_n_per_mm, ramp_s);
  swing_.retry();
}

void TapPipeline::applied(const hal::Vector3& force_n) noexcept {
  // The rest moves the arm. What the guard held back, it held back of both.
  const double passed_n = axis_.along_axis_n(force_n);
  const double share = command_n_ != 0.0 ? std::clamp(passed_n / command_n_, 0.0, 1.0) : 0.0;
  controller_.applied(passed_n - back_drive_n_ * share);
}

TapPipeline::Measured TapPipeline::measure(const hal::RigSample& sample) noexcept {
  // What was free under another zero may be a load under this one.
  if (zero_.take_bias(sample.bias_serial)) contact_.await_free();
  Measured now;
  now.interval = timer_.update(sample.time_ns - sample.position_age_ns);
  now.depth_mm = axis_.depth_mm(sample.tip_position_mm);
  if (structural_field_) structural_n_per_mm_ = structural_field_->stiffness_at(sample.tip_position_mm);
  if (has_depth_) now.step_mm = now.depth_mm - last_depth_mm_;
  last_depth_mm_ = now.depth_mm;
  has_depth_ = true;
  motion_.update(now.depth_mm, now.interval);
  now.sensor_n = axis_.reaction_n(sample.sensor_force_n - zero_.force_n());
  now.reaction_n = reaction_force_n(now.sensor_n, tool_mass_g_, motion_.acceleration_mm_per_s2());
  return now;
}

void TapPipeline::update_contact(const hal::RigSample& sample, const Measured& now) noexcept {
  const ContactStage::Input input{
      .interval = now.interval,
      .free_motion = {now.sensor_n, now.depth_mm, sample.time_ns - sample.position_age_ns,
                      sample.time_ns - sample.force_mean_age_ns},
      .tip_mm = now.depth_mm,
      .velocity_mm_per_s = motion_.velocity_mm_per_s(),
      .reaction_n = std::abs(now.reaction_n),
      .depth_mm = now.depth_mm,
      .contact_depth_mm = contact_depth_mm_,
      .acceleration_mm_per_s2 = std::abs(motion_.acceleration_mm_per_s2())};
  contact_.detect(input);
  if (contact_.begins()) swing_.begin();
  if (contact_.begins() || (now.interval.is_gap && !contact_.in_contact())) late_.reset();
  if (contact_.detector().just_declared()) {
    contact_depth_mm_ = looks_back_ ? contact_.onset_mm() : now.depth_mm;
    onset_friction_n_ = back_drive_.friction_n();
  }
  if (contact_.in_contact()) {
    const double path_mm = now.depth_mm - contact_depth_mm_;
    const double bent_mm =
        structural_n_per_mm_ > 0.0 ? controller_.device_force_n() / structural_n_per_mm_ : 0.0;
    contact_.judge({now.reaction_n, path_mm - bent_mm, path_mm, input.acceleration_mm_per_s2,
                    motion_.acceleration_mm_per_s2(), std::abs(bent_mm)},
                   now.interval);
  }
  follow_zero(sample, now.interval);
}

void TapPipeline::follow_zero(const hal::RigSample& sample, const TickInterval& interval) noexcept {
  if (!zero_.is_followed()) return;
  zero_.drift_on(interval);
  if (!contact_.zero_shows() && !contact_.zero_shows_in_motion()) return;
  // Along the axis what the tool's inertia leaves unexplained; across it the inertia averages out.
  const hal::Vector3 read_n = sample.sensor_force_n - zero_.force_n();
  const hal::Vector3 error_n =
      read_n + axis_.device_force_n(axis_.reaction_n(read_n) - contact_.residual_n());
  const SensorZero error{error_n, sample.sensor_torque_n_mm - zero_.torque_n_mm()};
  if (!contact_.zero_shows_in_motion()) return zero_.update(error, motion_.velocity_mm_per_s(), interval);
  zero_.take_over(error, ReadingInMotion::kTakeOverNPerS, interval);
}

double TapPipeline::friction_deflection_mm(double target_n_per_mm) const noexcept {
  if (structural_n_per_mm_ <= 0.0) return 0.0;
  return compensation_share(target_n_per_mm) *
         (back_drive_n_ - back_drive_.friction_n() + onset_friction_n_) / structural_n_per_mm_;
}

bool TapPipeline::hold_within_sensor(DesiredForce& desired, double encoder_mm) const noexcept {
  // A device that has less than that is bounded by the guard. NaN is the guard's to see.
  if (reach_.pull_n == reach_.push_n || !(desired.force_n > reach_.pull_n)) return false;
  desired = held_at(reach_.pull_n, encoder_mm);
  return true;
}

DesiredForce TapPipeline::held_at(double force_n, double encoder_mm) const noexcept {
  const double bent_mm = structural_n_per_mm_ > 0.0 ? force_n / structural_n_per_mm_ : 0.0;
  return {force_n, std::max(0.0, encoder_mm - bent_mm)};
}

DesiredForce TapPipeline::desired_force(const Measured& now, double target_n_per_mm) noexcept {
  // Predicted also before there is any authority, so that the slope is known once there is. What k~ x will
  // have grown by is predicted with it: of a delayed f_r - k~ x the hand feels (k - k~) τ of damping. To take
  // off k τ alone would leave less than none.
  double reaction_n = now.reaction_n;
  if (reaction_lead_.is_on()) {
    const double lead_n = reaction_lead_.update(now.reaction_n, now.interval);
    swing_.update(lead_n, now.interval.s);
    if (swing_.keeps_lead()) {
      reaction_n += compensation_share(target_n_per_mm) *
                    (lead_n - target_n_per_mm * displacement_lead_s_ * motion_.velocity_mm_per_s());
    }
  }
  if (!contact_.in_contact()) return {};
  const double encoder_mm = now.depth_mm - contact_depth_mm_ - friction_deflection_mm(target_n_per_mm);
  // a (f_r + δ - k~ x): what the evidence allows of (3.3), solved as one where the device bends.
  const double share = contact_.authority();
  if (contact_.needs_evidence() && (share > 0.0 || late_.has_begun())) {
    const double x_mm = late_.has_begun() ? displacement_mm_ : std::max(0.0, encoder_mm);
    reaction_n +=
        late_.update(target_n_per_mm * x_mm, reaction_n, motion_.velocity_mm_per_s(), now.interval.s);
  }
  DesiredForce desired =
      structural_n_per_mm_ > 0.0
          ? desired_force_compensated(share * reaction_n, share * target_n_per_mm, encoder_mm,
                                      structural_n_per_mm_, swing_.structure_share())
          : desired_force_rigid(share * reaction_n, share * target_n_per_mm, encoder_mm);
  if (const double most_n = contact_.max_force_n(); std::abs(desired.force_n) > most_n) {
    const double bound_n = std::copysign(most_n, desired.force_n);
    const double bends = structural_n_per_mm_ > 0.0
                             ? swing_.structure_share() * share * target_n_per_mm / structural_n_per_mm_
                             : 0.0;
    late_.hold_back((bound_n - desired.force_n) * std::max(1.0 - bends, 1.0 - kMaxCompensableRatio) / share);
    desired = held_at(bound_n, encoder_mm);
  }
  is_held_ = hold_within_sensor(desired, encoder_mm);
  // A little that is read at the surface and above it is most likely nothing: to take it off would pull at
  // it.
  if (contact_.needs_evidence()) {
    const double sure = std::max(desired.displacement_mm / kSurfaceMm, now.reaction_n / kLittleN - 1.0);
    desired.force_n *= std::clamp(sure, 0.0, 1.0);
  }
  return desired;
}

[[gnu::flatten]] PipelineOutput TapPipeline::evaluate(const hal::RigSample& sample) noexcept {
  const Measured now = measure(sample);
  update_contact(sample, now);
  const bool in_contact = contact_.in_contact();

  double target = target_.update(now.interval.periods, displacement_mm_);
  if (contact_.begins()) soft_object_.begin(target);
  if (in_contact && contact_.needs_evidence())
    target = soft_object_.update(target, now.reaction_n, displacement_mm_, now.interval.s);
  rendered_n_per_mm_ = target;
  is_held_ = false;
  const DesiredForce desired = desired_force(now, target);
  reaction_n_ = now.reaction_n;
  displacement_mm_ = desired.displacement_mm;
  desired_n_ = fade_.update(in_contact, desired.force_n, now.interval);
  if (back_drive_.is_on()) {
    back_drive_n_ = back_drive_.update(now.step_mm) *
                    (contact_.authority() * compensation_share(target) * late_.rendered_share());
  }
  const double gain_share = in_contact ? swing_.gain_share() : 1.0;  // the end of a contact is not slowed
  command_n_ =
      end_.update(in_contact, controller_.update(desired_n_, gain_share) + back_drive_n_, now.interval);
  return {axis_.device_force_n(command_n_),
          in_contact,
          std::abs(desired_n_) >= kTraceN,
          is_held_ ? guard_limit::kForce : std::uint8_t{0},
          touch_of(contact_, now.reaction_n, displacement_mm_),
          faults()};
}

void TapPipeline::fill_record(TickRecord& record) const noexcept {
  record.velocity_mm_per_s = motion_.velocity_mm_per_s();
  record.acceleration_mm_per_s2 = motion_.acceleration_mm_per_s2();
  record.reaction_force_n = reaction_n_;
  fill_contact(contact_, record);
  record.zero = zero_.zero();
  record.displacement_mm = displacement_mm_;
  record.target_stiffness_n_per_mm = rendered_n_per_mm_;
  record.desired_force_n = desired_n_;
  record.commanded_force_n = command_n_;
  record.hand_force_n = record.feasible_min_n_per_mm = record.feasible_max_n_per_mm = 0.0;
  if (!contact_.in_contact()) return;
  const double hand_n = reaction_n_ - controller_.device_force_n();  // (3.1)
  record.hand_force_n = hand_n;
  if (displacement_mm_ > 0.0) {
    const FeasibleRange range = feasible_range(reaction_n_ / displacement_mm_, hand_n, reach_);
    record.feasible_min_n_per_mm = range.min_n_per_mm;
    record.feasible_max_n_per_mm = range.max_n_per_mm;
  }
}

}  // namespace hapticd::rt
