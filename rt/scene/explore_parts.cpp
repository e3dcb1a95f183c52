#include "rt/scene/explore_parts.h"

#include "rt/control/loop_delay.h"

namespace hapticd::rt {

namespace {

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

ToolLoad tool_load_of(const SceneSpec& spec) {
  const ExploreParameters& e = spec.explore;
  ToolLoad load = e.sensor_mounting ? ToolLoad::mounted(spec.tool_mass_g, *e.sensor_mounting)
                                    : ToolLoad(spec.tool_mass_g, e.gravity_at_bias);
  if (e.tip_to_centre_mm) load.set_tip_to_centre(*e.tip_to_centre_mm);
  return load;
}

}  // namespace

ToolMotion tool_motion_of(const SceneSpec& spec, const hal::RigInfo& rig) {
  const bool bends = spec.structural_compensation;
  return ToolMotion({.load = tool_load_of(spec),
                     .deflection = StructuralDeflection(bends ? spec.structural_stiffness_n_per_mm : 0.0,
                                                        spec.explore.deflection_cutoff_hz, rig.rate_hz),
                     .structural_field = bends ? spec.structural_field : std::nullopt,
                     .mass_is_off_tip = spec.explore.tip_to_centre_mm.has_value(),
                     .zero_bound_n = spec.contact.zero_bound_n,
                     .position_resolution_mm = rig.device.position_resolution_mm,
                     .rate_hz = rig.rate_hz});
}

ExploredContact explored_contact_of(const SceneSpec& spec, const ObjectModel& model, double rate_hz) {
  return {spec.contact, spec.tool_mass_g, direction_of(spec, model, rate_hz),
          displacement_of(spec, model, rate_hz), rate_hz};
}

StiffnessForce stiffness_force_of(const SceneSpec& spec, double rate_hz) {
  const double delay_s = reaction_delay_s(spec.controller, rate_hz);
  const double reaction_lead_s = spec.compensation.reaction_lead_share.value_or(0.0) * delay_s;
  return {{.is_modulated = spec.explore.modulated,
           .keeps_friction = spec.explore.friction_feel == FrictionFeel::kKept,
           .needs_evidence = spec.contact.evidence.required,
           .fades_last_force = spec.explore.release == ReleaseMethod::kFade,
           .lead_s = 1e-3 * spec.compensation.lead_ms,
           .delay_s = delay_s},
          TargetBlend(spec.target, rate_hz, spec.max_target_change_n_per_s),
          ReactionLead(reaction_lead_s, rate_hz)};
}

}  // namespace hapticd::rt
