#include "rt/scene/explore_pipeline.h"

#include <algorithm>
#include <cmath>

#include "rt/control/compensation_fade.h"
#include "rt/control/loop_delay.h"
#include "rt/scene/explore_parts.h"
#include "rt/scene/fill_contact.h"
#include "rt/scene/fill_modulation.h"
#include "rt/signal/ticks.h"
#include "rt/target/release_fade.h"

namespace hapticd::rt {

namespace {

constexpr double kRegainS = 0.1;        // ringing after a bounce is over by then
constexpr double kSensorLateS = 0.005;  // at most, behind the encoders

}  // namespace

ExplorePipeline::ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig)
    : options_(resolved.explore),
      reach_(device_reach(resolved.guard.max_force_n, rig)),
      lead_s_(1e-3 * resolved.compensation.lead_ms),
      lead_now_s_(lead_s_),
      delay_s_(reaction_delay_s(resolved.controller, rig.rate_hz)),
      load_(resolved.explore.sensor_mounting
                ? ToolLoad::mounted(resolved.tool_mass_g, *resolved.explore.sensor_mounting)
                : ToolLoad(resolved.tool_mass_g, resolved.explore.gravity_at_bias)),
      zero_(resolved.contact.zero_bound_n),
      timer_(rig.rate_hz),
      motion_(rig.device.position_resolution_mm, rig.rate_hz),
      deflection_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0,
                  resolved.explore.deflection_cutoff_hz, rig.rate_hz),
      structural_field_(resolved.structural_compensation ? resolved.structural_field : std::nullopt),
      contact_parameters_(resolved.contact),
      contact_(resolved.contact, resolved.tool_mass_g, rig.rate_hz),
      regain_ticks_(ticks_of(kRegainS, rig.rate_hz)),
      direction_(direction_of(resolved, model, rig.rate_hz)),
      displacement_(displacement_of(resolved, model, rig.rate_hz)),
      target_(resolved.target, rig.rate_hz, resolved.max_target_change_n_per_s),
      passivity_(rig.rate_hz),
      controller_(resolved.controller, rig.rate_hz),
      end_(resolved.guard.max_force_n),
      reaction_lead_(resolved.compensation.reaction_lead_share.value_or(0.0) *
                         reaction_delay_s(resolved.controller, rig.rate_hz),
                     rig.rate_hz),
      back_drive_(resolved.compensation.back_drive ? rig.device.coulomb_friction_n : 0.0) {
  if (resolved.explore.tip_to_centre_mm) {
    load_.set_tip_to_centre(*resolved.explore.tip_to_centre_mm);
    mass_motion_.emplace(rig.device.position_resolution_mm, rig.rate_hz);
  }
  if (!resolved.inclusions.empty()) inclusions_.emplace(resolved.inclusions);
  if (resolved.transient) {
    transient_.emplace(*resolved.transient, grip_plant_of(resolved, model, rig),
                       resolved.guard.max_force_rate_n_per_s / rig.rate_hz, rig.rate_hz);
  }
  if (resolved.friction_target) friction_.emplace(*resolved.friction_target, model.rod_friction->kinetic);
}

std::uint32_t ExplorePipeline::channels() const noexcept {
  std::uint32_t all = channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget |
                      channel::kControl | channel::kDirection | channel::kZero;
  if (options_.displacement == DisplacementEstimator::kFused) all |= channel::kFusion;
  if (options_.passivity) all |= channel::kPassivity;
  if (inclusions_) all |= channel::kInclusion;
  if (friction_) all |= channel::kFriction;
  if (transient_) all |= channel::kTransient;
  return all;
}

void ExplorePipeline::reset() noexcept {
  timer_.reset();
  motion_.reset();
  if (mass_motion_) mass_motion_->reset();
  contact_.reset();
  pull_.reset();
  deflection_.reset();
  displacement_.reset();
  if (inclusions_) inclusions_->reset();
  if (friction_) friction_->rest();
  if (transient_) transient_->reset();
  transient_n_ = {};
  controller_.reset();
  end_.reset();
  reaction_lead_.reset();
  reaction_ahead_n_ = 0.0;
  back_drive_.reset();
  back_drive_direction_n_ = back_drive_n_ = command_n_ = {};
  has_tip_ = false;
  release_share_ = 0.0;
  desired_before_n_ = {};
}

void ExplorePipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target, ramp_s);
}

void ExplorePipeline::applied(const hal::Vector3& force_n) noexcept {
  // The rest moves the motors. What the guard held back, it held back of both.
  const double wanted = dot(command_n_, command_n_);
  const double passed = wanted > 0.0 ? std::clamp(dot(force_n, command_n_) / wanted, 0.0, 1.0) : 0.0;
  controller_.applied(force_n - (back_drive_n_ + transient_n_) * passed);
}

ExplorePipeline::Measured ExplorePipeline::measure(const hal::RigSample& sample) noexcept {
  // What was free under another zero may be a load under this one.
  if (zero_.take_bias(sample.bias_serial)) contact_.await_free();
  const std::int64_t position_ns = sample.time_ns - sample.position_age_ns;
  Measured now;
  now.interval = timer_.update(position_ns);
  motion_.update(sample.tip_position_mm, position_ns);
  if (structural_field_)
    deflection_.set_stiffness_n_per_mm(structural_field_->stiffness_at(sample.tip_position_mm));
  now.tip_mm =
      sample.tip_position_mm - deflection_.update(controller_.device_force_n(), now.interval.periods);
  now.encoder_mm = sample.tip_position_mm;
  now.velocity_mm_per_s = motion_.velocity_mm_per_s();
  now.acceleration_mm_per_s2 = motion_.acceleration_mm_per_s2();
  now.mass_mm = sample.tip_position_mm;
  now.mass_acceleration_mm_per_s2 = now.acceleration_mm_per_s2;
  if (mass_motion_) {
    now.mass_mm = load_.centre_mm(sample.tip_position_mm, sample.tip_orientation);
    mass_motion_->update(now.mass_mm, position_ns);
    now.mass_acceleration_mm_per_s2 = mass_motion_->acceleration_mm_per_s2();
  }
  now.load_n = load_.without_weight_n(sample.sensor_force_n - zero_.zero().force_n, sample.tip_orientation);
  now.reaction_n = now.load_n + load_.inertia_n(now.mass_acceleration_mm_per_s2);
  if (has_tip_) {
    now.step_mm = now.tip_mm - last_tip_mm_;
    if (back_drive_.is_on()) {
      back_drive_direction_n_ = back_drive_.update(sample.tip_position_mm - last_encoder_mm_);
    }
  }
  last_tip_mm_ = now.tip_mm;
  last_encoder_mm_ = sample.tip_position_mm;
  has_tip_ = true;
  return now;
}

void ExplorePipeline::detect(const hal::RigSample& sample, const Measured& now) noexcept {
  // If the reaction pushes, the tip is not above the surface, whatever the path says.
  const bool pushed = dot(now.reaction_n, direction_.normal()) > contact_parameters_.threshold_n;
  const double counted_mm = displacement_.displacement_mm();
  const double depth_mm = pushed ? std::max(0.0, counted_mm) : counted_mm;
  ContactStage3::Input input;
  input.interval = now.interval;
  // Signed as the residual wants it: in free motion the load is -m a.
  input.free_motion = {now.load_n * -1.0, now.mass_mm, sample.time_ns - sample.position_age_ns,
                       sample.time_ns - sample.force_mean_age_ns};
  input.tip_mm = now.tip_mm;
  input.velocity_mm_per_s = now.velocity_mm_per_s;
  input.reaction_n = norm(now.reaction_n);
  input.depth_mm = depth_mm;
  input.acceleration_mm_per_s2 = norm(now.mass_acceleration_mm_per_s2);
  contact_.detect(input);
  // After a bounce the tool may rest on the object without the detector knowing how deep. A law does.
  const bool pulls = is_pulled(now, input.reaction_n);
  if (pulls && contact_.in_contact()) contact_.withdraw();
  regained_ = !pulls && displacement_.has_law() && contact_.detector().disturbed_ticks() >= regain_ticks_;
  if (regained_) contact_.declare(sample.time_ns - sample.position_age_ns);
}

bool ExplorePipeline::is_pulled(const Measured& now, double reaction_n) noexcept {
  if (!contact_parameters_.evidence.required) return false;
  if (contact_.detector().is_free()) pull_.release();
  if (reaction_n < contact_parameters_.threshold_n) return false;  // its direction is noise
  if (pull_.is_pull(now.reaction_n, now.tip_mm)) return true;
  const bool felt = contact_.authority() > 0.0 && reaction_n > 2.0 * contact_parameters_.threshold_n;
  const bool felt_unseen = contact_.detector().is_waiting() && reaction_n > contact_.max_free_force_n();
  if (felt || felt_unseen) pull_.remember(now.reaction_n, now.tip_mm);
  return false;
}

void ExplorePipeline::follow_zero(const hal::RigSample& sample, const TickInterval& interval) noexcept {
  if (!contact_.zero_shows() && !contact_.zero_shows_in_motion()) return;
  const SensorZero error{load_.in_sensor_frame(contact_.residual_n() * -1.0, sample.tip_orientation),
                         sample.sensor_torque_n_mm - zero_.zero().torque_n_mm};
  if (!contact_.zero_shows_in_motion()) return zero_.update(error, interval);
  zero_.take_over(error, ReadingInMotion3::kTakeOverNPerS, interval);
}

void ExplorePipeline::begin_contact(const Measured& now) noexcept {
  direction_.begin(now.reaction_n);
  passivity_.begin();
  path_mm_ = 0.0;
  path_check_.begin();
  late_.reset();
  if (regained_) return displacement_.begin_unseen(now.tip_mm, norm(now.reaction_n));
  const double below_threshold_n = contact_parameters_.release_ratio * contact_parameters_.threshold_n;
  const bool looks_back = contact_parameters_.method == ContactMethod::kMatchedInertia;
  displacement_.begin(looks_back ? contact_.onset_mm() : now.tip_mm, now.tip_mm, direction_.normal(),
                      below_threshold_n);
}

double ExplorePipeline::rate_mm_per_s(const Measured& now) const noexcept {
  return -dot(now.velocity_mm_per_s, direction_.normal());
}

double ExplorePipeline::estimate(const Measured& now) noexcept {
  if (!contact_.in_contact()) {
    const double unexplained_n = contact_.detector().disturbed_ticks() > 0 ? norm(now.reaction_n) : 0.0;
    displacement_.rest(-dot(now.step_mm, direction_.normal()), unexplained_n, now.interval);
    return 0.0;
  }
  if (contact_.detector().just_declared()) {
    begin_contact(now);
    return dot(now.reaction_n, direction_.normal());
  }
  const hal::Vector3 normal_before = direction_.normal();
  direction_.update(now.reaction_n, now.step_mm, now.velocity_mm_per_s, now.interval.periods);
  const hal::Vector3& normal = direction_.normal();
  const double normal_n = dot(now.reaction_n, normal);
  const double by_law_mm = displacement_.by_law().displacement_mm;
  displacement_.update(now.tip_mm, now.step_mm, normal_before, normal, normal_n, rate_mm_per_s(now),
                       now.interval);
  const double inward_mm = -dot(now.step_mm, normal_before);
  path_mm_ = std::max(0.0, path_mm_ + inward_mm);
  path_check_.update(inward_mm, norm(across(now.step_mm, normal_before)),
                     displacement_.by_law().displacement_mm - by_law_mm);
  return normal_n;
}

void ExplorePipeline::judge_contact(const Measured& now, double normal_n) noexcept {
  const double deflection_mm = norm(now.encoder_mm - now.tip_mm);
  contact_.judge({normal_n, displacement_.displacement_mm(), path_mm_, norm(now.acceleration_mm_per_s2),
                  -dot(now.acceleration_mm_per_s2, direction_.normal()), deflection_mm},
                 now.interval);
  if (!contact_parameters_.evidence.required || !displacement_.has_law()) return;
  const double uncertain_mm =
      ContactEvidence::kDeflectionError * deflection_mm + kSensorLateS * norm(now.velocity_mm_per_s);
  if (path_check_.is_contradicted(uncertain_mm)) contact_.await_free();
}

double ExplorePipeline::authority() const noexcept {
  return contact_.in_contact() ? contact_.authority() : release_share_ * release_authority_;
}

void ExplorePipeline::follow_release(const TickInterval& interval) noexcept {
  if (contact_.in_contact()) {
    release_share_ = 1.0;
    release_authority_ = contact_.authority();
    rendered_mm_ = std::max(0.0, displacement_.displacement_mm());
    return;
  }
  rendered_mm_ = std::clamp(displacement_.displacement_mm(), 0.0, rendered_mm_);
  release_share_ = std::max(0.0, release_share_ - interval.s / ReleaseFade::kDurationS);
  if (rendered_mm_ == 0.0 || options_.release == ReleaseMethod::kCut) release_share_ = 0.0;
}

hal::Vector3 ExplorePipeline::desired_force(const Measured& now, bool in_contact, double normal_n) noexcept {
  follow_release(now.interval);
  const double share = authority();
  const hal::Vector3& normal = direction_.normal();
  const double rate = rate_mm_per_s(now);
  if (!options_.modulated) return {};
  if (in_contact) {
    double target_n =
        target_.update(rendered_mm_ + lead_now_s_ * rate, rate, now.tip_mm, now.interval.periods);
    if (contact_.needs_evidence() && (share > 0.0 || late_.has_begun())) {
      target_n -= late_.update(target_n, normal_n + reaction_ahead_n_, rate, now.interval.s);
    }
    desired_before_n_ = options_.friction_feel == FrictionFeel::kKept
                            ? normal * (target_n - normal_n - reaction_ahead_n_)
                            : normal * (target_n - reaction_ahead_n_) - now.reaction_n;  // (4.4)
    return desired_before_n_ * share;
  }
  if (share == 0.0) {
    target_.rest(now.interval.periods);
    return {};
  }
  if (options_.release == ReleaseMethod::kFade) return desired_before_n_ * share;
  const double receding = std::min(0.0, rate);  // what is rendered may only shrink
  double target_n = target_.update(std::max(0.0, rendered_mm_ + lead_s_ * receding), receding, now.tip_mm,
                                   now.interval.periods);
  if (late_.has_begun()) target_n -= late_.update(target_n, 0.0, rate, now.interval.s);
  return normal * (share * target_n);
}

void ExplorePipeline::hold_within_evidence(hal::Vector3& desired_n) noexcept {
  const double size_n = norm(desired_n);
  const double most_n = contact_.max_force_n();
  if (!(size_n > most_n)) return;
  const hal::Vector3 bound_n = desired_n * (most_n / size_n);
  late_.hold_back(dot(desired_n - bound_n, direction_.normal()) / authority());
  desired_n = bound_n;
}

bool ExplorePipeline::hold_within_sensor(hal::Vector3& desired_n) const noexcept {
  // A device that has less than that is bounded by the guard. NaN is the guard's to see.
  const hal::Vector3& normal = direction_.normal();
  const double pull_n = -dot(desired_n, normal);
  if (reach_.pull_n == reach_.push_n || !(pull_n > reach_.pull_n)) return false;
  desired_n = desired_n + normal * (pull_n - reach_.pull_n);
  return true;
}

PipelineOutput ExplorePipeline::evaluate(const hal::RigSample& sample, TickRecord& record) noexcept {
  const Measured now = measure(sample);
  detect(sample, now);
  if (now.interval.is_gap) late_.reset();
  const double normal_n = estimate(now);
  if (contact_.in_contact()) judge_contact(now, normal_n);
  follow_zero(sample, now.interval);
  const bool in_contact = contact_.in_contact();
  // Followed also before there is any authority, so that the slope is known once there is.
  const double compensated = compensation_share(target_.stiffness_n_per_mm());
  if (reaction_lead_.is_on()) {
    reaction_ahead_n_ = compensated * reaction_lead_.update(normal_n, now.interval);
    // If the reaction is predicted, the displacement is too, by all of the delay: else less than no damping
    // is left.
    lead_now_s_ = lead_s_ + compensated * std::max(0.0, delay_s_ - lead_s_);
  }
  hal::Vector3 desired_n = desired_force(now, in_contact, normal_n);
  if (inclusions_) desired_n = desired_n + inclusion_force(now);
  if (friction_) desired_n = desired_n + friction_force(now, normal_n);
  if (options_.passivity && release_share_ > 0.0) {
    desired_n = desired_n + passivity_.update(now.reaction_n, controller_.device_force_n(), now.step_mm,
                                              now.velocity_mm_per_s, now.interval.periods) *
                                authority();
  }
  hold_within_evidence(desired_n);
  const bool is_held = hold_within_sensor(desired_n);
  back_drive_n_ = back_drive_direction_n_ * (authority() * compensated);
  // The observer's f_d is the last tick's until the new command is applied.
  command_n_ = controller_.update(desired_n) + back_drive_n_;
  if (transient_) {  // not through the controller, whose lag would smear it
    transient_n_ = transient_force(now);
    command_n_ = command_n_ + transient_n_;
  }
  command_n_ = end_.update(in_contact, command_n_, now.interval);
  fill_record(now, in_contact, normal_n, desired_n, record);
  return {command_n_, in_contact, std::abs(dot(desired_n, direction_.normal())) >= kTraceN,
          is_held ? guard_limit::kForce : std::uint8_t{0},
          touch_of(contact_, in_contact ? std::max(0.0, displacement_.displacement_mm()) : 0.0)};
}

void ExplorePipeline::fill_record(const Measured& now, bool in_contact, double normal_n,
                                  const hal::Vector3& desired_n, TickRecord& record) const noexcept {
  const hal::Vector3& normal = direction_.normal();
  record.velocity_mm_per_s = rate_mm_per_s(now);
  record.acceleration_mm_per_s2 = -dot(now.acceleration_mm_per_s2, normal);
  record.reaction_force_n = normal_n;
  fill_contact(contact_, record);
  record.zero = zero_.zero();
  record.reaction_n = now.reaction_n;
  if (inclusions_) {
    record.inclusion = static_cast<std::uint32_t>(inclusions_->strongest());
    record.inclusion_position_mm = inclusions_->strongest_place_mm();
    record.inclusion_force_n = inclusions_->force_n();
  }
  if (friction_) fill_friction(*friction_, record);
  if (transient_) fill_transient(*transient_, record);
  record.desired_force_n = -dot(desired_n, normal);
  record.commanded_force_n = -dot(command_n_, normal);
  record.target_stiffness_n_per_mm = target_.stiffness_n_per_mm();
  if (!in_contact) return;
  record.normal = normal;
  record.friction_force_n = direction_.friction_n();
  record.sliding_mm_per_s = norm(across(now.velocity_mm_per_s, normal));
  record.displacement_mm = std::max(0.0, displacement_.displacement_mm());
  record.law_displacement_mm = displacement_.by_law().displacement_mm;
  record.displacement_deviation_mm = displacement_.deviation_mm();
  record.hand_energy_mj = passivity_.energy_mj();
  record.passivity_damping_n_s_per_mm = passivity_.damping_n_s_per_mm();
  record.hand_force_n = normal_n + dot(controller_.device_force_n(), normal);  // (4.1) along the normal
  if (friction_) {
    const double along_n = dot(controller_.device_force_n(), normal);
    const double spare_n = std::sqrt(std::max(0.0, reach_.push_n * reach_.push_n - along_n * along_n));
    const FrictionRange range =
        feasible_friction(norm(direction_.friction_n()), record.hand_force_n, spare_n);
    record.friction_feasible_min = range.min;
    record.friction_feasible_max = range.max;
  }
  if (record.displacement_mm > 0.0) {
    const FeasibleRange range =
        feasible_range(normal_n / record.displacement_mm, record.hand_force_n, reach_);
    record.feasible_min_n_per_mm = range.min_n_per_mm;
    record.feasible_max_n_per_mm = range.max_n_per_mm;
  }
}

}  // namespace hapticd::rt
