#include "rt/scene/effects.h"

#include <sstream>

#include "rt/contribution/friction_force.h"
#include "rt/contribution/inclusion_force.h"
#include "rt/contribution/passivity_force.h"
#include "rt/contribution/transient_force.h"
#include "rt/modulation/grip_inverse.h"

namespace hapticd::rt {

namespace {

std::string where(const SceneSpec& spec) {
  return "scene '" + spec.name + "'";
}

std::string inclusion_stage(const SceneSpec& spec) {
  const bool published = spec.inclusions.front().variant == InclusionVariant::kPublished;
  return "inclusions: " + std::to_string(spec.inclusions.size()) +
         (published ? ", (5.4)-(5.7)" : ", gradient of an energy");
}

std::optional<hal::Error> check_inclusions(const SceneSpec& spec, const ObjectModel*, const hal::RigInfo&) {
  if (spec.kind != SceneKind::kExplore) {
    return hal::Error::of(hal::ErrorCode::kMisplacedKey, "only scenes that explore have inclusions",
                          where(spec), "", "kind = \"explore\"", "remove [[inclusion]], or choose that kind");
  }
  for (std::size_t i = 0; i < spec.inclusions.size(); ++i) {
    const std::string prefix = "inclusion[" + std::to_string(i) + "].";
    if (auto error = check(spec.inclusions[i], prefix, where(spec))) return error;
  }
  return std::nullopt;
}

std::string friction_stage(const SceneSpec& spec) {
  const FrictionTarget& target = *spec.friction_target;
  std::ostringstream text;
  if (target.scale) {
    text << "friction target: " << *target.scale << " times the real friction";
  } else {
    text << "friction target: coefficient " << target.coefficient.value_or(0.0) << " at the hand";
  }
  return text.str();
}

/// A friction target needs a rod, friction that is kept, the tracked direction and passivity control.
std::optional<hal::Error> check_friction(const SceneSpec& spec, const ObjectModel* model,
                                         const hal::RigInfo&) {
  const ExploreParameters& e = spec.explore;
  const auto refused = [&](const char* why, const char* limit) {
    return hal::Error::of(hal::ErrorCode::kContradiction, std::string("a friction target needs ") + why,
                          where(spec), "", limit, "change that, or remove [friction_target]");
  };
  if (spec.kind != SceneKind::kExplore) return refused("a scene that explores", "kind = \"explore\"");
  if (spec.tip != Tip::kRod) return refused("a tip that rubs", "tool.tip = \"rod\"");
  if (e.friction_feel != FrictionFeel::kKept) return refused("the real friction", "friction.feel = \"kept\"");
  if (e.direction != DirectionMethod::kTracked)
    return refused("friction and normal distinguished", "direction.method = \"tracked\"");
  if (!e.passivity) return refused("the passivity control", "passivity.control = true");
  if (auto error = check(*spec.friction_target, "friction_target.", where(spec))) return error;
  if (model != nullptr && model->rod_friction && model->rod_friction->kinetic > 0.0) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kContradiction, "a friction target needs an object with friction",
                        where(spec), "object_model = \"" + spec.object_model + "\"", "kinetic friction > 0",
                        "");
}

std::string transient_stage(const SceneSpec& spec) {
  return "transient: " + std::to_string(spec.transient->target.size()) +
         " decaying sinusoids at each contact, through the inverse of device and grip";
}

/// A transient needs a scene that explores, and a device whose mass and structure are known.
std::optional<hal::Error> check_transient(const SceneSpec& spec, const ObjectModel*,
                                          const hal::RigInfo& rig) {
  if (spec.kind != SceneKind::kExplore) {
    return hal::Error::of(hal::ErrorCode::kMisplacedKey, "only scenes that explore have a transient",
                          where(spec), "", "kind = \"explore\"", "remove [transient], or choose that kind");
  }
  if (!(rig.device.apparent_mass_g > 0.0) || !(spec.structural_stiffness_n_per_mm > 0.0)) {
    return hal::Error{"a transient needs a device whose mass and structural stiffness are known", where(spec),
                      rig.device.model, "", "remove [transient], or state them in the rig"};
  }
  return check(*spec.transient, rig.rate_hz, "transient.", where(spec));
}

/// Plant of a grip. The tip touches what is rendered: a linear target's stiffness, else nothing is known of
/// it.
GripPlant grip_plant_of(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo& rig) {
  constexpr double kImpactN = 1.0;
  const bool is_linear = spec.explore.modulated && spec.target.kind == TargetLaw::Kind::kLinear;
  double object_n_per_mm = spec.transient->grip.object_stiffness_n_per_mm;
  if (object_n_per_mm == 0.0) {
    object_n_per_mm =
        is_linear ? spec.target.stiffness_n_per_mm : stiffness_n_per_mm(model, kImpactN).value_or(0.0);
  }
  return grip_plant(spec.transient->grip, rig.device.apparent_mass_g, spec.structural_stiffness_n_per_mm,
                    spec.tool_mass_g, object_n_per_mm);
}

using Made = std::unique_ptr<Contribution>;

Made make_inclusions(const SceneSpec& spec, const ObjectModel&, const hal::RigInfo&) {
  return std::make_unique<InclusionForce>(spec.inclusions);
}

Made make_friction(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo&) {
  return std::make_unique<FrictionForce>(*spec.friction_target, model.rod_friction->kinetic,
                                         spec.guard.max_force_n);
}

Made make_transient(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo& rig) {
  return std::make_unique<TransientForce>(ContactTransient(*spec.transient, grip_plant_of(spec, model, rig),
                                                           spec.guard.max_force_rate_n_per_s / rig.rate_hz,
                                                           rig.rate_hz));
}

Made make_passivity(const SceneSpec&, const ObjectModel&, const hal::RigInfo& rig) {
  return std::make_unique<PassivityForce>(rig.rate_hz);
}

}  // namespace

std::span<const Effect> effects() {
  using Spec = const SceneSpec&;
  static constexpr auto kDesired = &Contributions::desired;
  static constexpr auto kDirect = &Contributions::direct;
  static const Effect all[] = {
      {[](Spec s) { return !s.inclusions.empty(); }, inclusion_stage, channel::kInclusion, check_inclusions,
       make_inclusions, kDesired},
      {[](Spec s) { return s.friction_target.has_value(); }, friction_stage, channel::kFriction,
       check_friction, make_friction, kDesired},
      {[](Spec s) { return s.transient.has_value(); }, transient_stage, channel::kTransient, check_transient,
       make_transient, kDirect},
      // Last: it answers for the forces before it.
      {[](Spec s) { return s.kind == SceneKind::kExplore && s.explore.passivity; },
       [](Spec) { return std::string("passivity: observer and controller at the hand's port"); },
       channel::kPassivity, nullptr, make_passivity, kDesired},
  };
  return all;
}

Contributions contributions_of(const SceneSpec& spec, const ObjectModel& model, const hal::RigInfo& rig) {
  Contributions all;
  for (const Effect& effect : effects()) {
    if (!effect.is_asked_for(spec)) continue;
    (all.*effect.joins).push_back(effect.make(spec, model, rig));
    all.channels |= effect.channels;
  }
  return all;
}

}  // namespace hapticd::rt
