#pragma once

#include <string>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::study {

/// The objects of D§4.
inline const std::vector<std::string>& explored_objects() {
  static const std::vector<std::string> names{"sponge_cut", "foam_ball_3d", "rubber_ball_3d",
                                              "silicone_rest"};
  return names;
}

inline constexpr double kExploreToolMassG = 12.59;  // D§4.3.1

inline sim::SimulationConfig explore_rig(const std::string& device, const std::string& object,
                                         const std::string& tip) {
  sim::SimulationConfig rig;
  rig.device = device;
  rig.object = object;
  rig.tip = tip;
  rig.tool_mass_g = kExploreToolMassG;
  return rig;
}

/// Two strokes back and forth with a swaying tool, on which estimators are judged.
inline sim::HandProgram judged_strokes(double force_n, double speed_mm_per_s) {
  sim::HandProgram hand;
  hand.kind = sim::HandProgram::Kind::kStroke;
  hand.force_n = force_n;
  hand.speed_mm_per_s = speed_mm_per_s;
  hand.stroke_length_mm = 50.0;
  hand.repetitions = 2;
  hand.approach_mm_per_s = 40.0;
  hand.force_rate_n_per_s = 6.0;
  hand.tilt_deg = 10.0;
  return hand;
}

/// Time at which they are over, approach and retreat included.
inline double judged_strokes_end_s(const sim::HandProgram& hand) {
  constexpr double kPeakOverMean = 1.875;  // of a minimum-jerk motion
  return 4.5 + kPeakOverMean * (hand.force_n / hand.force_rate_n_per_s +
                                3.5 * hand.stroke_length_mm / hand.speed_mm_per_s);
}

/// The explore scenes as the service ships them.
inline rt::SceneSpec explore_scene(rt::Tip tip) {
  rt::SceneSpec scene;
  scene.name = tip == rt::Tip::kRod ? "explore_rod" : "explore_bearing";
  scene.kind = rt::SceneKind::kExplore;
  scene.tip = tip;
  scene.tool_mass_g = kExploreToolMassG;
  scene.contact.threshold_n = 0.02;
  scene.max_target_stiffness_n_per_mm = 1000.0;
  return scene;
}

/// The pipeline of D§4 as published, but for what would diverge or has the wrong sign there: Kd per sample,
/// Dahl's exact step, (4.25) with the sign of (4.26).
inline rt::SceneSpec dissertation_scene(rt::Tip tip) {
  rt::SceneSpec scene = explore_scene(tip);
  scene.contact.method = rt::ContactMethod::kFilteredAcceleration;
  scene.contact.evidence.required = false;
  scene.contact.threshold_n = 0.06;
  scene.explore.direction = rt::DirectionMethod::kPublished;
  scene.explore.displacement = rt::DisplacementEstimator::kInverse;
  scene.explore.law = rt::ContactLawKind::kHuntCrossley;
  scene.explore.friction_feel = rt::FrictionFeel::kCancelled;
  scene.explore.release = rt::ReleaseMethod::kCut;
  scene.explore.passivity = false;
  scene.compensation = {.lead_ms = 0.0, .reaction_lead_share = 0.0, .back_drive = false};
  scene.explore.deflection_cutoff_hz = 0.0;
  return scene;
}

}  // namespace hapticd::study
