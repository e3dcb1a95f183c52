#include "hal/sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hal/sim/base/rotation.h"

namespace hapticd::sim {

using hal::Vector3;

bool ToolMounting::plain() const noexcept {
  return !centre_mm && sensor_to_tool.w == 1.0 && is_zero(force_offset_n) && is_zero(torque_offset_n_mm);
}

Simulation::Simulation(const DeviceModel& device, double tool_mass_kg, std::uint64_t seed,
                       const ToolMounting& mounting, double step_s, const Conditions& conditions,
                       bool sensor_samples_wait)
    : device_(device),
      tool_mass_kg_(tool_mass_kg),
      mounting_(mounting),
      plain_mounting_(mounting.plain()),
      step_s_(step_s),
      step_ns_(std::llround(1e9 * step_s)),
      slow_steps_(std::max<std::int64_t>(1, std::llround(1e-3 / step_s))),
      random_(seed),
      conditions_(conditions),
      unevenness_(conditions),
      hidden_arm_(device.arm, conditions, seed),
      vibration_(conditions, seed),
      sensor_(tool_mass_kg, seed ^ 0x6e616e6f3137ULL, conditions, step_s, sensor_samples_wait),
      encoder_delay_steps_(
          static_cast<std::size_t>(std::llround(1e-3 * conditions.encoder_delay_ms / step_s))) {
  for (double& phase : tremor_phase_) phase = 2.0 * std::numbers::pi * random_.uniform();
  for (std::size_t i = 0; i < 3; ++i) axes_[i] = {i == 2 ? 10.0 : 0.0, 0.0, i == 2 ? 10.0 : 0.0, 0.0};
  truth_.tip_position_mm = {0.0, 0.0, 10.0};
  // Biased with the tool hanging free, upright and at rest.
  const Vector3 weight_n{0.0, 0.0, -1e-3 * tool_mass_kg * kGravityMmPerS2};
  if (plain_mounting_) {
    sensor_.bias_at(weight_n);
  } else {
    const Vector3 lever = mounting_.centre_mm.value_or(Vector3{0.0, 0.0, -Nano17::kLeverMm});
    sensor_.bias_at(to_tool(mounting_.sensor_to_tool, weight_n) - mounting_.force_offset_n,
                    to_tool(mounting_.sensor_to_tool, cross(lever, weight_n)) - mounting_.torque_offset_n_mm);
  }
}

void Simulation::set_hand(const PreparedHand* hand) noexcept {
  sway_before_rad_ = hand_ != nullptr ? sway(hand_time_s()) : Vector3{};
  const Vector3 a_step_ago_rad = hand_ != nullptr ? sway(hand_time_s() - step_s_) : Vector3{};
  for (std::size_t i = 0; i < 3; ++i) {
    const double here = component(sway_before_rad_, i);
    sway_ends_[i] =
        MinimumJerk({here, (here - component(a_step_ago_rad, i)) / step_s_, 0.0}, {}, kSwayBuildsUpS);
  }
  hand_began_step_ = steps_;
  followed_contour_ = false;
  hand_ = hand;
  motion_.emplace(hand->program, Vector3{axes_[0].tip_mm, axes_[1].tip_mm, axes_[2].tip_mm});
}

void Simulation::set_object(PlacedObject* object) noexcept {
  object_ = object;
}

void Simulation::command(const Vector3& force_n) noexcept {
  if (!std::isfinite(force_n.x + force_n.y + force_n.z)) return;  // no DAC has a code for it
  const std::int64_t due = steps_ + std::llround(device_.command_latency_s / step_s_);
  // Within one step the last word counts; so no more can be on their way than the latency has steps.
  if (pending_count_ > 0 && pending_[pending_count_ - 1].due_step == due) --pending_count_;
  if (pending_count_ == pending_.size()) --pending_count_;
  pending_[pending_count_++] = {due, force_n};
}

// Force of the motors: latency, DAC, saturation and the amplifier's pole. Returns the mean over the step,
// exact for a first-order lag.
Vector3 Simulation::motor_force() noexcept {
  while (pending_count_ > 0 && pending_[0].due_step <= steps_) {
    const double quantum = device_.force_step_n();
    for (std::size_t i = 0; i < 3; ++i) {
      const double bounded =
          std::clamp(component(pending_[0].force_n, i), -device_.max_force_n, device_.max_force_n);
      component(wanted_n_, i) = std::round(bounded / quantum) * quantum;
    }
    std::move(pending_.begin() + 1, pending_.end(), pending_.begin());
    --pending_count_;
  }
  const double rate = 2.0 * std::numbers::pi * device_.amplifier_pole_hz * step_s_;
  const double decay = std::exp(-rate);
  const Vector3 behind = amplifier_n_ - wanted_n_;
  amplifier_n_ = wanted_n_ + behind * decay;
  return wanted_n_ + behind * ((1.0 - decay) / rate);
}

void Simulation::step() noexcept {
  const double time_s = static_cast<double>(steps_) * step_s_;
  const HandImpedance& hand = hand_->impedance;
  std::array<const AxisDynamics*, 3> dynamics{&hand_->across, &hand_->across, &hand_->along};

  HandPerception felt;
  felt.tip_mm = {axes_[0].tip_mm, axes_[1].tip_mm, axes_[2].tip_mm};
  std::array<AxisDynamics, 3> here;
  if (!hand_->along_field.empty()) {
    here = dynamics_at(felt.tip_mm);
    dynamics = {&here[0], &here[1], &here[2]};
  }
  felt.press_force_n = -dot(truth_.hand_force_n, contour_normal_);
  felt.reaction_n = truth_.normal_force_n;
  HandIntent intent = motion_->step(step_s_, felt);
  contour_normal_ = {0.0, 0.0, 1.0};
  if (intent.follows_contour && object_ != nullptr) follow_contour(intent);
  const bool is_hand =
      hand_->program.kind != HandProgram::Kind::kWeight && hand_->program.kind != HandProgram::Kind::kShake;
  if (is_hand && steps_ % slow_steps_ == 0) tremor_mm_ = tremor(time_s);
  if (is_hand) intent.position_mm = intent.position_mm + tremor_mm_;
  // The rig's frame rides on the table: the hand, which is in the room, moves against it, and every mass is
  // as if pushed the other way.
  BaseMotion base;
  if (vibration_.active()) {
    base = vibration_.at(time_s);
    intent.position_mm = intent.position_mm - base.position_mm;
    intent.velocity_mm_per_s = intent.velocity_mm_per_s - base.velocity_mm_per_s;
  }

  Vector3 motor_n = motor_force();
  motor_n = motor_n + intent.motor_force_n;
  truth_.device_force_n = motor_n;

  std::array<AxisState, 3> next;
  std::array<double, 3> pull_n{};  // the part of the hand's force that does not depend on the state
  for (std::size_t i = 0; i < 3; ++i) {
    const double stiffness = i == 2 ? hand.stiffness_n_per_mm : hand.lateral_stiffness_n_per_mm;
    const double damping = i == 2 ? hand.damping_n_s_per_mm : hand.lateral_damping_n_s_per_mm;
    pull_n[i] = stiffness * component(intent.position_mm, i) +
                damping * component(intent.velocity_mm_per_s, i) + (i == 2 ? intent.support_n : 0.0);
    double on_motor_n = component(motor_n, i);
    double on_tip_n = pull_n[i];
    if (vibration_.active()) {
      const double arm = unevenness_.mass_factor(i, felt.tip_mm);
      const double a = 1e-3 * component(base.acceleration_mm_per_s2, i);
      on_motor_n -= arm * device_.motor_side_mass_kg() * a;
      on_tip_n -=
          (arm * device_.tip_side_mass_kg() + device_.sensor_mass_kg + tool_mass_kg_ + hand.mass_kg) * a;
    }
    next[i] = dynamics[i]->advance(axes_[i], on_motor_n, on_tip_n);
    // Dry friction, implicit: as much as stops the motor side within the step, but no more than it has.
    const double stopping_n = -next[i].motor_mm_per_s / dynamics[i]->motor_velocity_per_motor_force();
    double dry_n = device_.coulomb_friction_n;
    if (unevenness_.friction_varies()) dry_n *= unevenness_.friction_factor(i, felt.tip_mm);
    dynamics[i]->add_motor_force(next[i], std::clamp(stopping_n, -dry_n, dry_n));
  }
  if (object_ != nullptr) {
    touch(felt.tip_mm, next, dynamics);
  } else {
    truth_.reaction_force_n = {};
    truth_.normal_force_n = 0.0;
    truth_.friction_force_n = 0.0;
    truth_.displacement_mm = 0.0;
    truth_.surface_depression_mm = 0.0;
    truth_.in_contact = false;
  }

  Vector3 acceleration;
  for (std::size_t i = 0; i < 3; ++i) {
    const double stiffness = i == 2 ? hand.stiffness_n_per_mm : hand.lateral_stiffness_n_per_mm;
    const double damping = i == 2 ? hand.damping_n_s_per_mm : hand.lateral_damping_n_s_per_mm;
    component(acceleration, i) = (next[i].tip_mm_per_s - axes_[i].tip_mm_per_s) / step_s_;
    if (vibration_.active()) component(acceleration, i) += component(base.acceleration_mm_per_s2, i);
    component(truth_.hand_force_n, i) = pull_n[i] - stiffness * next[i].tip_mm -
                                        damping * next[i].tip_mm_per_s -
                                        1e-3 * hand.mass_kg * component(acceleration, i);
  }
  axes_ = next;
  truth_.tip_position_mm = {axes_[0].tip_mm, axes_[1].tip_mm, axes_[2].tip_mm};
  ++steps_;
  load_sensor(acceleration, time_s);
  if (encoder_delay_steps_ > 0) {
    seen_.push({{axes_[0].motor_mm, axes_[1].motor_mm, axes_[2].motor_mm},
                {axes_[0].motor_mm_per_s, axes_[1].motor_mm_per_s, axes_[2].motor_mm_per_s},
                orientation_});
  }
}

void Simulation::read_device(hal::RigSample& sample, std::int64_t beyond_ns) noexcept {
  const double quantum = device_.encoder_resolution_mm;
  const bool delayed = encoder_delay_steps_ > 0 && !seen_.empty();
  const hal::Quaternion& orientation =
      delayed ? seen_.delayed(encoder_delay_steps_).orientation : orientation_;
  for (std::size_t i = 0; i < 3; ++i) {
    double motor_mm = delayed ? seen_.delayed(encoder_delay_steps_).motor_mm[i] : axes_[i].motor_mm;
    if (beyond_ns > 0) {
      motor_mm += 1e-9 * static_cast<double>(beyond_ns) *
                  (delayed ? seen_.delayed(encoder_delay_steps_).motor_mm_per_s[i] : axes_[i].motor_mm_per_s);
    }
    component(sample.tip_position_mm, i) =
        hidden_arm_.exact() ? std::round(motor_mm / quantum) * quantum : motor_mm;
  }
  if (delayed && conditions_.delays_reported > 0.5) {
    sample.position_age_ns = static_cast<std::int64_t>(encoder_delay_steps_) * step_ns_;
  }
  const double noise = device_.gimbal_noise_rad;
  const double about_x = noise * random_.normal();
  sample.tip_orientation = composed(orientation, rotation({about_x, noise * random_.normal(), 0.0}));
  if (conditions_.orientation_error_deg != 0.0) {
    const double error_rad = conditions_.orientation_error_deg * std::numbers::pi / 180.0;
    sample.tip_orientation = composed(rotation({error_rad, 0.0, 0.0}), sample.tip_orientation);
  }
  if (hidden_arm_.exact()) {
    sample.angles = angles_of(device_.arm, sample.tip_position_mm, sample.tip_orientation);
  } else {
    sample.angles = hidden_arm_.counted(sample.tip_position_mm, sample.tip_orientation,
                                        quantum / device_.arm.first_link_mm);
    sample.tip_position_mm = hidden_arm_.reported_tip_mm(sample.angles);
    sample.tip_orientation = hidden_arm_.reported_orientation(sample.angles);
  }
  sample.time_ns = time_ns() + beyond_ns;
}

}  // namespace hapticd::sim
