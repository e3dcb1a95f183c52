#include "rt/scene/explore_parts.h"

namespace hapticd::rt {

Direction direction_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz) {
  const bool bearing = spec.tip == Tip::kBallBearing;
  const FrictionParameters friction = bearing ? model.bearing_friction.value_or(kBallBearingFriction)
                                              : model.rod_friction.value_or(FrictionParameters{});
  if (spec.explore.direction == DirectionMethod::kTracked) {
    return Direction(TrackedDirection(friction, spec.explore.force_noise_n, rate_hz));
  }
  return Direction(
      PublishedDirection(bearing ? FrictionLaw::kCoulombViscous : FrictionLaw::kDahl, friction, rate_hz));
}

Displacement displacement_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz) {
  const ExploreParameters& e = spec.explore;
  if (e.displacement == DisplacementEstimator::kRecursive) {
    return Displacement(RecursiveDisplacement{}, std::monostate{});
  }
  const bool creeps = e.law == ContactLawKind::kCreep;
  const ContactLaw law = creeps ? ContactLaw(CreepLaw(model.creep->parameters, rate_hz))
                                : ContactLaw(model.hunt_crossley->parameters);
  if (e.displacement == DisplacementEstimator::kInverse) {
    return Displacement(InverseDisplacement{ButterworthLowPass(InverseDisplacement::kCutoffHz, rate_hz)},
                        law);
  }
  const double error = creeps ? model.creep->relative_error : model.hunt_crossley->relative_error;
  return Displacement(FusedDisplacement(error, e.force_noise_n, rate_hz), law);
}

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

}  // namespace hapticd::rt
