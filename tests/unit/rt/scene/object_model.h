#pragma once

#include "hal/rig.h"
#include "rt/model/models.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::rt::test {

inline constexpr double kExploreToolMassG = 12.59;

inline hal::RigInfo bench_rig(const std::string& device = "phantom_1_5_high_force") {
  hal::RigInfo info;
  info.name = "bench";
  const bool strong = device == "phantom_1_5_high_force";
  info.device = {device, strong ? 37.5 : 8.5, strong ? 6.2 : 1.4, 0.03, strong ? 2.537 : 3.5, 75.0};
  info.sensor = {"nano17_si_25", 35.0, 1.0 / 640.0, 10000.0, kExploreToolMassG};
  return info;
}

inline constexpr double kObjectNPerMm = 0.4;

/// A model of an object of 0.4 N/mm that yields a fifth of its displacement late, with everything a scene
/// may ask for.
inline ObjectModel bench_model() {
  ObjectModel model;
  model.name = "bench_object";
  model.identified_on = "nothing: made up";
  model.max_displacement_mm = 20.0;
  model.max_force_n = 8.0;
  model.hunt_crossley = IdentifiedLaw<HuntCrossleyParameters>{{kObjectNPerMm, 1e-4, 1.0}, 0.05};
  CreepParameters creep{.weight = {0.8, 0.1, 0.05, 0.05, 0.0}, .max_force_n = 8.0};
  for (std::size_t j = 0; j < CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (CreepParameters::kKnots - 1);
    creep.displacement_mm[j] = creep.max_force_n * share * share / kObjectNPerMm;
  }
  model.creep = IdentifiedLaw<CreepParameters>{creep, 0.05};
  model.rod_friction = FrictionParameters{0.3, 0.3, 0.0};
  return model;
}

/// Model with Maxwell-slip friction of the rod: sharp, level 0.35.
inline ObjectModel maxwell_slip_model() {
  ObjectModel model = bench_model();
  const MaxwellSlipParameters elements{{0.26, 0.29, 0.32, 0.36}, {0.35, 0.42, 0.25, 0.15}};
  model.rod_friction = FrictionParameters{elements.kinetic(), elements.presliding_mm(), 0.0, 1.0, elements};
  return model;
}

/// The explore scenes as the service ships them.
inline SceneSpec explore_scene(Tip tip) {
  SceneSpec scene;
  scene.name = tip == Tip::kRod ? "explore_rod" : "explore_bearing";
  scene.kind = SceneKind::kExplore;
  scene.tip = tip;
  scene.object_model = "bench_object";
  scene.tool_mass_g = kExploreToolMassG;
  scene.contact.threshold_n = 0.02;
  scene.max_target_stiffness_n_per_mm = 1000.0;
  return scene;
}
/// The pipeline of D§4 as published.
inline SceneSpec dissertation_scene(Tip tip) {
  SceneSpec scene = explore_scene(tip);
  scene.contact.method = ContactMethod::kFilteredAcceleration;
  scene.contact.evidence.required = false;
  scene.contact.threshold_n = 0.06;
  scene.explore.direction = DirectionMethod::kPublished;
  scene.explore.displacement = DisplacementEstimator::kInverse;
  scene.explore.law = ContactLawKind::kHuntCrossley;
  scene.explore.friction_feel = FrictionFeel::kCancelled;
  scene.explore.release = ReleaseMethod::kCut;
  scene.explore.passivity = false;
  scene.explore.deflection_cutoff_hz = 0.0;
  return scene;
}

}  // namespace hapticd::rt::test
