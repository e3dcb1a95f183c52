#include "hal/sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hapticd::sim {

using hal::Vector3;

namespace {

constexpr double kGravityMmPerS2 = 9807.0;
constexpr double kTremorMm = 0.03;
constexpr double kWobbleRad = 0.005;
constexpr double kSwayAboutXHz = 0.35;
constexpr double kSwayAboutYHz = 0.45;
constexpr double kSwayBuildsUpS = 1.0;
constexpr int kFieldSteps = 128;  // neighbours differ by 1 %, so that what lies between is right to 2e-5
constexpr int kMassSteps = 16;    // neighbours differ by 5 % at most: right to 1e-3 of what the mass changes
constexpr double kTiltTakesS = 0.5;

double& component(Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}
double component(const Vector3& v, std::size_t i) noexcept {
  return i == 0 ? v.x : i == 1 ? v.y : v.z;
}

/// R^T v for the tool's orientation.
Vector3 to_tool(const hal::Quaternion& q, const Vector3& v) noexcept {
  const Vector3 axis{-q.x, -q.y, -q.z};
  const auto cross = [](const Vector3& a, const Vector3& b) {
    return Vector3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const Vector3 t = cross(axis, v) * 2.0;
  return v + t * q.w + cross(axis, t);
}

Vector3 cross(const Vector3& a, const Vector3& b) noexcept {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
hal::Quaternion inverse(const hal::Quaternion& q) noexcept {
  return {q.w, -q.x, -q.y, -q.z};
}
bool is_zero(const Vector3& v) noexcept {
  return dot(v, v) == 0.0;
}

/// Rotation by the length of a vector about its direction.
hal::Quaternion rotation(const Vector3& rad) noexcept {
  const double half = 0.5 * std::sqrt(dot(rad, rad));
  const double share = half > 1e-12 ? 0.5 * std::sin(half) / half : 0.5;
  return {std::cos(half), share * rad.x, share * rad.y, share * rad.z};
}

/// First b, then a.
hal::Quaternion composed(const hal::Quaternion& a, const hal::Quaternion& b) noexcept {
  return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

}  // namespace

bool ToolMounting::plain() const noexcept {
  return !centre_mm && sensor_to_tool.w == 1.0 && is_zero(force_offset_n) && is_zero(torque_offset_n_mm);
}

AxisParameters axis_of(const DeviceModel& device, double tool_mass_kg, double hand_mass_kg,
                       double hand_stiffness_n_per_mm, double hand_damping_n_s_per_mm,
                       double arm_mass_factor) {
  AxisParameters axis;
  axis.motor_mass_kg = arm_mass_factor * device.motor_side_mass_kg();
  axis.tip_mass_kg =
      arm_mass_factor * device.tip_side_mass_kg() + device.sensor_mass_kg + tool_mass_kg + hand_mass_kg;
  axis.structural_stiffness_n_per_mm = device.structural_stiffness_n_per_mm;
  // Damping ratio of the bare device's free-free mode: c = 2 ζ μ ω.
  const double reduced_kg = device.motor_side_mass_kg() * device.tip_side_mass_kg() / device.apparent_mass_kg;
  axis.structural_damping_n_s_per_mm = 1e-3 * 2.0 * device.structural_damping * reduced_kg * 2.0 *
                                       std::numbers::pi * device.structural_mode_hz;
  axis.motor_viscosity_n_s_per_mm = device.viscous_friction_n_s_per_mm;
  axis.hand_stiffness_n_per_mm = hand_stiffness_n_per_mm;
  axis.hand_damping_n_s_per_mm = hand_damping_n_s_per_mm;
  return axis;
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

PreparedHand Simulation::prepare(const HandProgram& program) const {
  PreparedHand prepared;
  prepared.program = program;
  prepared.impedance = impedance_of(program);
  const HandImpedance& hand = prepared.impedance;

  const AxisParameters axis =
      axis_of(device_, tool_mass_kg_, hand.mass_kg, hand.stiffness_n_per_mm, hand.damping_n_s_per_mm);
  prepared.along = AxisDynamics(axis, step_s_);
  AxisParameters across = axis;
  across.hand_stiffness_n_per_mm = hand.lateral_stiffness_n_per_mm;
  across.hand_damping_n_s_per_mm = hand.lateral_damping_n_s_per_mm;
  prepared.across = AxisDynamics(across, step_s_);
  const bool structure_varies = !device_.structural_field.constant();
  if (structure_varies || unevenness_.mass_varies()) {
    const auto field = [&](double hand_stiffness_n_per_mm, double hand_damping_n_s_per_mm) {
      std::vector<AxisDynamics> all;
      const int masses = unevenness_.mass_varies() ? kMassSteps : 0;
      const double lightest = unevenness_.smallest_mass_factor();
      const double range = unevenness_.largest_mass_factor() - lightest;
      for (int m = 0; m <= masses; ++m) {
        AxisParameters parameters =
            axis_of(device_, tool_mass_kg_, hand.mass_kg, hand_stiffness_n_per_mm, hand_damping_n_s_per_mm,
                    masses > 0 ? lightest + range * m / masses : 1.0);
        const double home_n_per_mm = parameters.structural_stiffness_n_per_mm;
        for (int i = 0; i <= (structure_varies ? kFieldSteps : 0); ++i) {
          if (structure_varies) {
            const double log_compliance = std::numbers::ln2 * (2.0 * i / kFieldSteps - 1.0);
            parameters.structural_stiffness_n_per_mm = home_n_per_mm * std::exp(-log_compliance);
          }
          all.emplace_back(parameters, step_s_);
        }
      }
      return all;
    };
    prepared.along_field = field(hand.stiffness_n_per_mm, hand.damping_n_s_per_mm);
    prepared.across_field = field(hand.lateral_stiffness_n_per_mm, hand.lateral_damping_n_s_per_mm);
  }
  return prepared;
}

std::array<AxisDynamics, 3> Simulation::dynamics_at(const Vector3& tip_mm) const noexcept {
  std::size_t structures = 1;
  std::size_t below = 0;
  double share = 0.0;
  if (!device_.structural_field.constant()) {
    structures = kFieldSteps + 1;
    const double log_compliance = device_.structural_field.log_compliance(tip_mm);
    const double at = 0.5 * kFieldSteps * (1.0 + log_compliance / std::numbers::ln2);
    below = static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, kFieldSteps - 1.0));
    share = at - static_cast<double>(below);
  }
  const auto of_mass = [&](const std::vector<AxisDynamics>& field, std::size_t mass) {
    const std::size_t first = mass * structures + below;
    return structures == 1 ? field[first] : AxisDynamics::between(field[first], field[first + 1], share);
  };
  if (!unevenness_.mass_varies()) {
    const AxisDynamics across = of_mass(hand_->across_field, 0);
    return {across, across, of_mass(hand_->along_field, 0)};
  }
  const double lightest = unevenness_.smallest_mass_factor();
  const double range = unevenness_.largest_mass_factor() - lightest;
  std::array<AxisDynamics, 3> all;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& field = axis == 2 ? hand_->along_field : hand_->across_field;
    const double at = kMassSteps * (unevenness_.mass_factor(axis, tip_mm) - lightest) / range;
    const auto mass = static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, kMassSteps - 1.0));
    all[axis] =
        AxisDynamics::between(of_mass(field, mass), of_mass(field, mass + 1), at - static_cast<double>(mass));
  }
  return all;
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

// Latency, DAC, saturation and the amplifier's pole. Returns the mean force over the step, exact for a
// first-order lag.
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

Vector3 Simulation::tremor(double time_s) const noexcept {
  const auto wave = [&](double hz, std::size_t phase) {
    return std::sin(2.0 * std::numbers::pi * hz * time_s + tremor_phase_[phase]);
  };
  return {0.5 * kTremorMm * wave(8.3, 0), 0.5 * kTremorMm * wave(9.1, 1),
          0.5 * kTremorMm * (wave(8.7, 2) + wave(10.3, 3))};
}

// Rotation vector of the tilt that the hand means to give the tool. It grows out of where the hand before
// left it: from upright, unless that one swayed too.
Vector3 Simulation::sway(double hand_time_s) const noexcept {
  const double grown =
      MinimumJerk({}, {1.0, 0.0, 0.0}, kSwayBuildsUpS).at(std::min(hand_time_s, kSwayBuildsUpS)).position_mm;
  const double amplitude_rad = grown * hand_->program.tilt_deg * std::numbers::pi / 180.0;
  const double turn = 2.0 * std::numbers::pi * hand_time_s;
  const double ends_s = std::min(hand_time_s, kSwayBuildsUpS);
  // Where the tool's mass hangs next to the tip, a wrist that stopped within a step would be a blow.
  const Vector3 left_rad =
      plain_mounting_ ? sway_before_rad_ * (1.0 - grown)
                      : Vector3{sway_ends_[0].at(ends_s).position_mm, sway_ends_[1].at(ends_s).position_mm,
                                sway_ends_[2].at(ends_s).position_mm};
  return left_rad + Vector3{amplitude_rad * std::sin(kSwayAboutXHz * turn),
                            amplitude_rad * std::sin(kSwayAboutYHz * turn), 0.0};
}

hal::Quaternion Simulation::tool_orientation(double time_s) const noexcept {
  const Vector3 wobble{kWobbleRad * std::sin(2.0 * time_s + tremor_phase_[0]),
                       kWobbleRad * std::sin(2.6 * time_s + tremor_phase_[1]), 0.0};
  const hal::Quaternion held = composed(rotation(sway(hand_time_s())), rotation(wobble));
  return conditions_.tool_tilt_deg == 0.0 ? held : composed(rotation({tilt_rad(time_s), 0.0, 0.0}), held);
}

double Simulation::tilt_rad(double time_s) const noexcept {
  const double tilt = conditions_.tool_tilt_deg * std::numbers::pi / 180.0;
  if (conditions_.tool_tilt_at_s <= 0.0) return tilt;
  const double since_s = std::clamp(time_s - conditions_.tool_tilt_at_s, 0.0, kTiltTakesS);
  return MinimumJerk({}, {tilt, 0.0, 0.0}, kTiltTakesS).at(since_s).position_mm;
}

// Pressing straight down while moving sideways would jam the tip against the flank of anything curved.
void Simulation::follow_contour(HandIntent& intent) noexcept {
  const Vector3 meant_mm = intent.position_mm;
  const ObjectPose& pose = object_->pose;
  Vector3 above{intent.position_mm.x, intent.position_mm.y, 0.0};
  if (pose.displaced()) above = pose.to_object(above);
  Projection surface = project(object_->model.shape, above);
  if (pose.displaced()) {
    surface.point_mm = pose.to_rig(surface.point_mm);
    surface.outward_normal = pose.direction_to_rig(surface.outward_normal);
  }
  const Vector3& n = surface.outward_normal;
  const Vector3 along{intent.velocity_mm_per_s.x, intent.velocity_mm_per_s.y, 0.0};
  intent.velocity_mm_per_s = along - n * dot(along, n) + n * intent.velocity_mm_per_s.z;
  intent.position_mm = surface.point_mm + n * intent.position_mm.z;
  contour_normal_ = n;
  // Away from its usual home the surface lies higher or lower than where the motion counts from: what the
  // hand meant so far turns into what it means along the contour without a jump.
  if (is_zero(hand_->program.place_mm)) return;
  if (!followed_contour_) {
    followed_contour_ = true;
    contour_offset_mm_ = meant_mm - intent.position_mm;
    contour_began_step_ = steps_;
  }
  constexpr double kFadeS = 0.3;
  const double since_s = static_cast<double>(steps_ - contour_began_step_) * step_s_;
  if (since_s >= kFadeS) return;
  const MotionState left = MinimumJerk({1.0, 0.0, 0.0}, {}, kFadeS).at(since_s);
  intent.position_mm = intent.position_mm + contour_offset_mm_ * left.position_mm;
  intent.velocity_mm_per_s = intent.velocity_mm_per_s + contour_offset_mm_ * left.velocity_mm_per_s;
}

Vector3 Simulation::press_phantom(const Vector3& free_mm, double compliance_mm_per_n,
                                  const Projection& nearest, Material::Step& step) noexcept {
  const ObjectPose& pose = object_->pose;
  constexpr Vector3 kFarAwayMm{0.0, 0.0, 1e3};
  const Vector3 seen_mm = pose.displaced() ? pose.to_object(free_mm) : free_mm;
  const bool there = !pose.displaced() || pose.share_at(seen_mm) > 0.0;
  const PhantomBody::Step pressed =
      object_->phantom->advance(there ? seen_mm : kFarAwayMm, compliance_mm_per_n);
  const Vector3 force_n = pose.displaced() ? pose.direction_to_rig(pressed.force_n) : pressed.force_n;
  step = {dot(force_n, nearest.outward_normal), pressed.depth_mm, dot(force_n, nearest.outward_normal)};
  return force_n;
}

void Simulation::touch(const Vector3& before_mm, std::array<AxisState, 3>& axes,
                       const std::array<const AxisDynamics*, 3>& dynamics) noexcept {
  const Vector3 free_mm{axes[0].tip_mm, axes[1].tip_mm, axes[2].tip_mm};
  ObjectPose& pose = object_->pose;
  Vector3 object_moved_mm;
  double there = 1.0;
  Projection nearest;
  if (pose.displaced()) {
    pose.advance(truth_.reaction_force_n * -1.0);
    const Vector3 seen_mm = pose.to_object(free_mm);
    nearest = project(object_->model.shape, seen_mm);
    nearest.point_mm = pose.to_rig(nearest.point_mm);
    nearest.outward_normal = pose.direction_to_rig(nearest.outward_normal);
    object_moved_mm = pose.moved_mm(free_mm);
    there = pose.share_at(seen_mm);
  } else {
    nearest = project(object_->model.shape, free_mm);
  }
  const Vector3& n = nearest.outward_normal;

  double compliance = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    compliance += component(n, i) * component(n, i) * dynamics[i]->tip_position_per_tip_force();
  }
  // Matter that is stiffer by a factor meets a tip that yields more by it, in forces smaller by it.
  double scale = object_->model.stiffness_scale(nearest.point_mm);
  if (pose.displaced()) scale *= there;
  constexpr double kFarAwayMm = -1e3;
  Material::Step step;
  Vector3 across_n;  // a phantom's force is not along the normal
  if (object_->phantom) {
    across_n = press_phantom(free_mm, compliance, nearest, step);
    across_n = across_n - n * step.force_n;
  } else {
    step = std::visit(
        [&](auto& material) {
          return there > 0.0 ? material.advance(nearest.depth_mm, compliance * scale)
                             : material.advance(kFarAwayMm, compliance);
        },
        object_->material);
    step.mean_force_n *= scale;
    step.force_n *= scale;
  }

  Vector3 tangential_n;
  if (step.mean_force_n > 0.0) {
    const Vector3 moved = free_mm - before_mm - object_moved_mm;
    tangential_n = std::visit(
        [&](auto& friction) {
          friction.project(n);
          return friction.advance(moved - n * dot(moved, n), dynamics[0]->tip_position_per_tip_force(),
                                  step.mean_force_n);
        },
        object_->friction);
  } else {
    std::visit([](auto& friction) { friction.release(); }, object_->friction);
  }
  const Vector3 mean_n = n * step.mean_force_n + across_n + tangential_n;
  for (std::size_t i = 0; i < 3; ++i) dynamics[i]->add_tip_force(axes[i], component(mean_n, i));

  truth_.reaction_force_n = n * step.force_n + across_n + tangential_n;
  truth_.undeformed_contact_mm = nearest.point_mm;
  truth_.outward_normal = n;
  truth_.displacement_mm = std::max(0.0, step.depth_mm);
  truth_.normal_force_n = step.force_n;
  truth_.friction_force_n = std::sqrt(dot(across_n + tangential_n, across_n + tangential_n));
  truth_.surface_depression_mm =
      object_->phantom
          ? truth_.displacement_mm
          : std::visit([](const auto& material) { return material.depression_mm(); }, object_->material);
  truth_.in_contact = step.mean_force_n > 0.0;
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

// What the object gives, less what it takes to accelerate the tool, plus its weight.
void Simulation::load_sensor(const Vector3& acceleration, double time_s) noexcept {
  const Vector3 gravity{0.0, 0.0, -kGravityMmPerS2};
  if (!plain_mounting_) {
    orientation_ = tool_orientation(time_s);
    Vector3 of_centre = acceleration;
    if (mounting_.centre_mm) {
      // The mass is carried round the tip as the tool turns; the sensor's origin is a lever above the tip.
      const Vector3 arm = *mounting_.centre_mm + Vector3{0.0, 0.0, Nano17::kLeverMm};
      const Vector3 now = to_tool(inverse(orientation_), arm);
      if (centres_known_ == 2) {
        of_centre = of_centre +
                    (now - centre_before_mm_[0] * 2.0 + centre_before_mm_[1]) * (1.0 / (step_s_ * step_s_));
      } else {
        ++centres_known_;
      }
      centre_before_mm_ = {now, centre_before_mm_[0]};
    }
    const Vector3 tool_n = to_tool(orientation_, (gravity - of_centre) * (1e-3 * tool_mass_kg_));
    const Vector3 reaction_n = to_tool(orientation_, truth_.reaction_force_n);
    const Vector3 tip_mm{0.0, 0.0, -Nano17::kLeverMm};
    const Vector3 torque_n_mm =
        cross(tip_mm, reaction_n) + cross(mounting_.centre_mm.value_or(tip_mm), tool_n);
    sensor_.measure(to_tool(mounting_.sensor_to_tool, reaction_n + tool_n),
                    to_tool(mounting_.sensor_to_tool, torque_n_mm));
    return;
  }
  const bool sways = hand_->program.tilt_deg > 0.0 || dot(sway_before_rad_, sway_before_rad_) > 0.0 ||
                     conditions_.tool_tilt_deg != 0.0;
  if (sways || steps_ % slow_steps_ == 0) orientation_ = tool_orientation(time_s);
  sensor_.measure(
      to_tool(orientation_, truth_.reaction_force_n + (gravity - acceleration) * (1e-3 * tool_mass_kg_)));
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
    component(sample.tip_position_mm, i) = std::round(motor_mm / quantum) * quantum;
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
  sample.time_ns = time_ns() + beyond_ns;
}

}  // namespace hapticd::sim
