#include "rt/scene/explore_pipeline.h"

#include <algorithm>

#include "rt/target/feasible_range.h"

namespace hapticd::rt {

namespace {

constexpr double kInverseCutoffHz = 60.0;
constexpr double kReleaseS = 0.5;  // the target is followed so long after a release, fading
constexpr double kOnsetDeviationMm = 0.03;
constexpr double kRegainedDeviationMm = 0.15;
constexpr std::uint32_t kRegainTicks = 100;  // ringing after a bounce is over by then

FrictionParameters friction_of(const SceneSpec& spec, const ObjectModel& model) noexcept {
  return spec.tip == Tip::kBallBearing ? kBallBearingFriction
                                       : model.rod_friction.value_or(FrictionParameters{});
}

std::variant<TrackedDirection, PublishedDirection> direction_of(const SceneSpec& spec,
                                                                const ObjectModel& model, double rate_hz) {
  const FrictionParameters friction = friction_of(spec, model);
  if (spec.explore.direction == DirectionMethod::kTracked) {
    return TrackedDirection(friction, spec.explore.force_noise_n, rate_hz);
  }
  const FrictionLaw law = spec.tip == Tip::kBallBearing ? FrictionLaw::kCoulombViscous : FrictionLaw::kDahl;
  return PublishedDirection(law, friction, rate_hz);
}

std::variant<std::monostate, CreepLaw, HuntCrossleyParameters> law_of(const SceneSpec& spec,
                                                                      const ObjectModel& model,
                                                                      double rate_hz) {
  if (spec.explore.displacement == DisplacementEstimator::kRecursive) return std::monostate{};
  if (spec.explore.law == ContactLawKind::kHuntCrossley) return model.hunt_crossley->parameters;
  return CreepLaw(model.creep->parameters, rate_hz);
}

double law_error(const SceneSpec& spec, const ObjectModel& model) noexcept {
  return spec.explore.law == ContactLawKind::kHuntCrossley ? model.hunt_crossley->relative_error
                                                           : model.creep->relative_error;
}

}  // namespace

ExplorePipeline::ExplorePipeline(const SceneSpec& resolved, const ObjectModel& model, const hal::RigInfo& rig)
    : options_(resolved.explore),
      max_force_n_(resolved.guard.max_force_n),
      lead_s_(1e-3 * resolved.explore.lead_ms),
      load_(resolved.tool_mass_g, resolved.explore.gravity_at_bias),
      motion_{MotionEstimator(rig.device.position_resolution_mm, rig.rate_hz),
              MotionEstimator(rig.device.position_resolution_mm, rig.rate_hz),
              MotionEstimator(rig.device.position_resolution_mm, rig.rate_hz)},
      deflection_(resolved.structural_compensation ? resolved.structural_stiffness_n_per_mm : 0.0,
                  resolved.explore.deflection_cutoff_hz, rig.rate_hz),
      contact_parameters_(resolved.contact),
      residual_(resolved.tool_mass_g, rig.rate_hz),
      contact_(resolved.contact),
      direction_(direction_of(resolved, model, rig.rate_hz)),
      estimator_(Particle{}),
      law_(law_of(resolved, model, rig.rate_hz)),
      release_step_(1.0 / (kReleaseS * rig.rate_hz)),
      target_(resolved.target, rig.rate_hz),
      passivity_(rig.rate_hz),
      controller_{ForceController(resolved.controller, rig.rate_hz),
                  ForceController(resolved.controller, rig.rate_hz),
                  ForceController(resolved.controller, rig.rate_hz)},
      back_drive_(resolved.explore.back_drive_compensation ? rig.device.coulomb_friction_n : 0.0) {
  if (options_.release == ReleaseMethod::kFade) {
    release_step_ = 1.0 / (ReleaseFade::kDurationS * rig.rate_hz);
  }
  switch (options_.displacement) {
    case DisplacementEstimator::kFused:
      estimator_ = FusedDisplacement(law_error(resolved, model), options_.force_noise_n, rig.rate_hz);
      break;
    case DisplacementEstimator::kInverse:
      estimator_ = Inverse{ButterworthLowPass(kInverseCutoffHz, rig.rate_hz)};
      break;
    case DisplacementEstimator::kRecursive:
      break;
  }
}

std::uint32_t ExplorePipeline::channels() const noexcept {
  std::uint32_t all = channel::kMotion | channel::kContact | channel::kDeformation | channel::kTarget |
                      channel::kControl | channel::kDirection;
  if (options_.displacement == DisplacementEstimator::kFused) all |= channel::kFusion;
  if (options_.passivity) all |= channel::kPassivity;
  return all;
}

void ExplorePipeline::reset() noexcept {
  for (MotionEstimator& axis : motion_) axis.reset();
  residual_.reset();
  contact_.reset();
  onset_.forget();
  deflection_.reset();
  for (ForceController& axis : controller_) axis.reset();
  back_drive_.reset();
  back_drive_n_ = {};
  if (auto* creep = std::get_if<CreepLaw>(&law_)) creep->reset();
  law_now_ = {};
  has_tip_ = false;
  displacement_mm_ = 0.0;
  release_share_ = 0.0;
  desired_before_n_ = {};
}

void ExplorePipeline::set_target(const TargetLaw& target, double ramp_s) noexcept {
  target_.set(target, ramp_s);
}

void ExplorePipeline::applied(const hal::Vector3& force_n) noexcept {
  const hal::Vector3 on_tip_n = force_n - back_drive_n_;  // the rest moves the motors
  controller_[0].applied(on_tip_n.x);
  controller_[1].applied(on_tip_n.y);
  controller_[2].applied(on_tip_n.z);
}

const hal::Vector3& ExplorePipeline::normal() const noexcept {
  if (const auto* tracked = std::get_if<TrackedDirection>(&direction_)) return tracked->normal();
  return std::get_if<PublishedDirection>(&direction_)->normal();
}

const hal::Vector3& ExplorePipeline::friction_n() const noexcept {
  if (const auto* tracked = std::get_if<TrackedDirection>(&direction_)) return tracked->friction_n();
  return std::get_if<PublishedDirection>(&direction_)->friction_n();
}

ExplorePipeline::Measured ExplorePipeline::measure(const hal::RigSample& sample) noexcept {
  Measured now;
  motion_[0].update(sample.tip_position_mm.x, sample.time_ns);
  motion_[1].update(sample.tip_position_mm.y, sample.time_ns);
  motion_[2].update(sample.tip_position_mm.z, sample.time_ns);
  now.velocity_mm_per_s = {motion_[0].velocity_mm_per_s(), motion_[1].velocity_mm_per_s(),
                           motion_[2].velocity_mm_per_s()};
  now.acceleration_mm_per_s2 = {motion_[0].acceleration_mm_per_s2(), motion_[1].acceleration_mm_per_s2(),
                                motion_[2].acceleration_mm_per_s2()};
  const hal::Vector3 device_n{controller_[0].device_force_n(), controller_[1].device_force_n(),
                              controller_[2].device_force_n()};
  now.tip_mm = sample.tip_position_mm - deflection_.update(device_n);
  back_drive_n_ = back_drive_.update(has_tip_ ? sample.tip_position_mm - last_encoder_mm_ : hal::Vector3{});
  last_encoder_mm_ = sample.tip_position_mm;
  now.step_mm = has_tip_ ? now.tip_mm - last_tip_mm_ : hal::Vector3{};
  last_tip_mm_ = now.tip_mm;
  has_tip_ = true;
  now.reaction_n = load_.without_weight_n(sample) + load_.inertia_n(now.acceleration_mm_per_s2);
  return now;
}

bool ExplorePipeline::update_contact(const hal::RigSample& sample, const Measured& now) noexcept {
  // Where the reaction pushes, the tip is not above the surface, whatever the way says.
  const bool pushed = dot(now.reaction_n, normal()) > contact_parameters_.threshold_n;
  const double depth_mm = pushed ? std::max(0.0, displacement_mm_) : displacement_mm_;
  if (contact_parameters_.method == ContactMethod::kFilteredAcceleration) {
    return contact_.update(norm(now.reaction_n), depth_mm, 0.0);
  }
  // Signed as the residual wants it: in free motion what the tool bears is -m a.
  const hal::Vector3 residual_n = residual_.update(
      load_.without_weight_n(sample) * -1.0, sample.tip_position_mm, sample.time_ns, contact_.in_contact());
  onset_.remember(now.tip_mm, residual_.prompt_force_n());
  const bool in_contact = contact_.update(norm(residual_n), depth_mm, 0.0);
  if (contact_.just_left_surface()) residual_.assume_free();
  // After a bounce the tool may rest on the object without the detector knowing how deep. A law does.
  const bool has_law = !std::holds_alternative<std::monostate>(law_);
  regained_ = !in_contact && has_law && contact_.disturbed_ticks() >= kRegainTicks;
  if (regained_) contact_.declare();
  return contact_.in_contact();
}

void ExplorePipeline::begin_contact(const Measured& now) noexcept {
  std::visit([&](auto& direction) { direction.begin(now.reaction_n); }, direction_);
  hal::Vector3 began_mm = now.tip_mm;
  if (contact_parameters_.method == ContactMethod::kMatchedInertia) {
    began_mm = onset_.place_mm(contact_parameters_.release_ratio * contact_parameters_.threshold_n +
                               residual_.seen_jerk_n());
  }
  if (regained_ && std::holds_alternative<HuntCrossleyParameters>(law_)) {
    law_now_ = law_estimate(norm(now.reaction_n), 0.0);
  }
  // An object that has not recovered yet is met below its undeformed surface; the law remembers how far.
  const double residual_mm = law_now_.displacement_mm;
  displacement_mm_ = residual_mm;
  if (!regained_) displacement_mm_ += std::max(0.0, dot(began_mm - now.tip_mm, normal()));
  if (auto* fused = std::get_if<FusedDisplacement>(&estimator_)) {
    fused->begin(displacement_mm_, kOnsetDeviationMm + unfelt_displacement_mm() + 0.2 * residual_mm,
                 regained_ ? kRegainedDeviationMm : 0.0);
  } else if (auto* inverse = std::get_if<Inverse>(&estimator_)) {
    inverse->filter.seed(0.0);
  } else {
    std::get_if<Particle>(&estimator_)->contacted_mm = began_mm;
  }
  passivity_.begin();
}

double ExplorePipeline::unfelt_displacement_mm() const noexcept {
  const double unfelt_n = contact_parameters_.release_ratio * contact_parameters_.threshold_n;
  if (const auto* creep = std::get_if<CreepLaw>(&law_)) return creep->curve(unfelt_n).displacement_mm;
  if (const auto* law = std::get_if<HuntCrossleyParameters>(&law_)) {
    return hunt_crossley_displacement(*law, unfelt_n, 0.0).displacement_mm;
  }
  return 0.0;
}

LawEstimate ExplorePipeline::law_estimate(double normal_n, double rate_mm_per_s) noexcept {
  if (auto* creep = std::get_if<CreepLaw>(&law_)) return creep->update(normal_n);
  if (const auto* law = std::get_if<HuntCrossleyParameters>(&law_)) {
    return hunt_crossley_displacement(*law, normal_n, rate_mm_per_s);
  }
  return {};
}

void ExplorePipeline::update_displacement(const Measured& now, double normal_n,
                                          double rate_mm_per_s) noexcept {
  // By the normal before this tick's: what turned it must not count as way, or dithering would add up.
  const double way_mm = -dot(now.step_mm, normal_before_);
  if (auto* fused = std::get_if<FusedDisplacement>(&estimator_)) {
    law_now_ = law_estimate(normal_n, rate_mm_per_s);
    fused->update(way_mm, norm(across(now.step_mm, normal_before_)), law_now_);
    displacement_mm_ = fused->displacement_mm();
  } else if (auto* inverse = std::get_if<Inverse>(&estimator_)) {
    law_now_ = law_estimate(inverse->filter.update(normal_n), rate_mm_per_s);
    displacement_mm_ = law_now_.displacement_mm;
  } else {
    auto* particle = std::get_if<Particle>(&estimator_);
    particle->contacted_mm = particle->contacted_mm + across(now.step_mm, normal_before_);  // (4.21)
    displacement_mm_ = dot(particle->contacted_mm - now.tip_mm, normal());
  }
}

hal::Vector3 ExplorePipeline::desired_force(const Measured& now, bool in_contact, double normal_n,
                                            double rate_mm_per_s) noexcept {
  const double predicted_mm = std::max(0.0, displacement_mm_) + lead_s_ * rate_mm_per_s;
  if (in_contact) {
    release_share_ = 1.0;
    const double target_n = target_.update(predicted_mm, rate_mm_per_s, now.tip_mm);
    return options_.friction_feel == FrictionFeel::kKept ? normal() * (target_n - normal_n)
                                                         : normal() * target_n - now.reaction_n;  // (4.4)
  }
  release_share_ = release_share_ > release_step_ ? release_share_ - release_step_ : 0.0;
  if (displacement_mm_ <= 0.0 || options_.release == ReleaseMethod::kCut) release_share_ = 0.0;
  if (release_share_ == 0.0) {
    target_.rest();
    return {};
  }
  if (options_.release == ReleaseMethod::kFade) return desired_before_n_ * release_share_;
  return normal() * (release_share_ * target_.update(predicted_mm, rate_mm_per_s, now.tip_mm));
}

hal::Vector3 ExplorePipeline::evaluate(const hal::RigSample& sample, TickRecord& record) noexcept {
  const Measured now = measure(sample);
  const bool in_contact = update_contact(sample, now);
  double normal_n = 0.0;
  if (in_contact) {
    if (contact_.just_declared()) {
      begin_contact(now);
    } else {
      normal_before_ = normal();
      std::visit(
          [&](auto& direction) { direction.update(now.reaction_n, now.step_mm, now.velocity_mm_per_s); },
          direction_);
    }
    normal_n = dot(now.reaction_n, normal());
  }
  const double rate_mm_per_s = -dot(now.velocity_mm_per_s, normal());
  if (in_contact) {
    if (!contact_.just_declared()) update_displacement(now, normal_n, rate_mm_per_s);
  } else {
    displacement_mm_ -= dot(now.step_mm, normal());  // where the surface was
    // Only a law with memory has something to say about an object that is not touched, or not known to be.
    const double unsure_n = contact_.disturbed_ticks() > 0 ? norm(now.reaction_n) : 0.0;
    law_now_ = std::holds_alternative<CreepLaw>(law_) ? law_estimate(unsure_n, 0.0) : LawEstimate{};
  }

  hal::Vector3 desired_n = desired_force(now, in_contact, normal_n, rate_mm_per_s);
  if (in_contact) desired_before_n_ = desired_n;
  if (options_.passivity && in_contact) {
    const hal::Vector3 device_n{controller_[0].device_force_n(), controller_[1].device_force_n(),
                                controller_[2].device_force_n()};
    desired_n = desired_n + passivity_.update(now.reaction_n, device_n, now.step_mm, now.velocity_mm_per_s);
  }
  const hal::Vector3 controlled_n{controller_[0].update(desired_n.x), controller_[1].update(desired_n.y),
                                  controller_[2].update(desired_n.z)};
  const hal::Vector3 command_n = controlled_n + back_drive_n_;
  tell(now, in_contact, normal_n, rate_mm_per_s, desired_n, command_n, record);
  return command_n;
}

void ExplorePipeline::tell(const Measured& now, bool in_contact, double normal_n, double rate_mm_per_s,
                           const hal::Vector3& desired_n, const hal::Vector3& command_n,
                           TickRecord& record) const noexcept {
  const hal::Vector3& u = normal();
  record.velocity_mm_per_s = rate_mm_per_s;
  record.acceleration_mm_per_s2 = -dot(now.acceleration_mm_per_s2, u);
  record.reaction_force_n = normal_n;
  record.in_contact = in_contact;
  record.contact_reason = contact_.reason();
  record.contact_count = contact_.count();
  record.reaction_n = now.reaction_n;
  record.desired_force_n = -dot(desired_n, u);
  record.commanded_force_n = -dot(command_n, u);
  record.target_stiffness_n_per_mm = target_.stiffness_n_per_mm();
  if (!in_contact) return;
  record.normal = u;
  record.friction_force_n = friction_n();
  record.sliding_mm_per_s = norm(across(now.velocity_mm_per_s, u));
  record.displacement_mm = std::max(0.0, displacement_mm_);
  record.law_displacement_mm = law_now_.displacement_mm;
  if (const auto* fused = std::get_if<FusedDisplacement>(&estimator_)) {
    record.displacement_deviation_mm = fused->deviation_mm();
  }
  record.hand_energy_mj = passivity_.energy_mj();
  record.passivity_damping_n_s_per_mm = passivity_.damping_n_s_per_mm();
  const hal::Vector3 device_n{controller_[0].device_force_n(), controller_[1].device_force_n(),
                              controller_[2].device_force_n()};
  record.hand_force_n = normal_n + dot(device_n, u);  // (4.1) along the normal
  if (record.displacement_mm > 0.0) {
    const FeasibleRange range =
        feasible_range(normal_n / record.displacement_mm, record.hand_force_n, max_force_n_);
    record.feasible_min_n_per_mm = range.min_n_per_mm;
    record.feasible_max_n_per_mm = range.max_n_per_mm;
  }
}

}  // namespace hapticd::rt
