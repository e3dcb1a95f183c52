#include "tests/measure/study/common/palpation.h"

#include <cmath>
#include <vector>

#include "rt/signal/motion_estimator.h"
#include "server/identification/gate/palpation_tracker.h"
#include "tests/reference/contact_fit.h"
#include "tests/reference/friction_fit.h"
#include "tests/measure/study/common/plant.h"
#include "tests/measure/study/common/scenes.h"
#include "tests/measure/study/common/virtual_run.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::value_of;

/// A recursive scene watches: it needs no model, and rendering is off.
VirtualRun watching(const std::string& object, rt::SceneSpec& scene) {
  scene = explore_scene(rt::Tip::kBallBearing);
  scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  scene.target = rt::linear_target(0.0);
  return VirtualRun(explore_rig("phantom_1_5_high_force", object, "rod"), scene, false);
}

struct Press {
  double force_n, rate_n_per_s, hold_s;
};
/// Depths and speeds as a hand would mix them.
const std::vector<Press>& moderate_presses() {
  static const std::vector<Press> presses{
      {1.0, 4.0, 0.1}, {3.0, 10.0, 0.1}, {6.0, 6.0, 0.5}, {5.0, 30.0, 0.1}, {2.0, 1.0, 1.0}};
  return presses;
}
constexpr Press kDeepPress{12.0, 12.0, 0.2};

/// Presses on one spot and lets go; if `deep`, presses harder as well and taps.
std::vector<identification::PalpationSample> palpate(const std::string& object, bool deep) {
  rt::SceneSpec scene;
  VirtualRun run = watching(object, scene);
  identification::PalpationTracker tracker(scene.tool_mass_g, scene.contact.threshold_n,
                                           run.info().device.position_resolution_mm, run.info().rate_hz);
  std::vector<identification::PalpationSample> palpation;

  const auto record_for = [&](double seconds) {
    const double until_s = run.time_s() + seconds;
    while (run.time_s() < until_s) {
      run.step();
      palpation.push_back(tracker.update(run.sample()));
    }
  };
  std::vector<Press> presses = moderate_presses();
  if (deep) presses.push_back(kDeepPress);
  for (const Press& press : presses) {
    sim::HandProgram hand;
    hand.kind = sim::HandProgram::Kind::kPress;
    hand.force_n = press.force_n;
    hand.force_rate_n_per_s = press.rate_n_per_s;
    hand.hold_s = press.hold_s;
    hand.approach_mm_per_s = 40.0;
    run.set_hand(hand);
    record_for(1.2 + 1.875 * press.force_n / press.rate_n_per_s + press.hold_s + 1.2);
  }
  for (const double speed : {100.0, 200.0}) {
    if (!deep) break;
    sim::HandProgram hand;
    hand.kind = sim::HandProgram::Kind::kTap;
    hand.speed_mm_per_s = speed;
    hand.repetitions = 2;
    run.set_hand(hand);
    record_for(2.5);
  }
  return palpation;
}

std::vector<identification::StrokeSample> stroke(const std::string& object) {
  rt::SceneSpec scene;
  VirtualRun run = watching(object, scene);
  rt::MotionEstimator motion(run.info().device.position_resolution_mm, 1000.0);
  std::vector<identification::StrokeSample> strokes;
  for (const auto& [force_n, speed] : {std::pair{2.0, 60.0}, {4.0, 100.0}, {3.0, 150.0}}) {
    sim::HandProgram hand;
    hand.kind = sim::HandProgram::Kind::kStroke;
    hand.force_n = force_n;
    hand.speed_mm_per_s = speed;
    hand.stroke_length_mm = 50.0;
    hand.repetitions = 2;
    hand.force_rate_n_per_s = 4.0;
    hand.approach_mm_per_s = 40.0;
    run.set_hand(hand);
    const double until_s = run.time_s() + 2.0 + 1.875 * force_n / 4.0 + 4.0 * 1.875 * 50.0 / speed;
    while (run.time_s() < until_s) {
      run.step();
      motion.update(run.sample().tip_position_mm.x, run.sample().time_ns);
      strokes.push_back(
          {run.sample().tip_position_mm.x, motion.velocity_mm_per_s(), run.sample().sensor_force_n});
    }
  }
  return strokes;
}

}  // namespace

IdentificationResult identify(const std::string& object) {
  const std::vector<identification::PalpationSample> palpation = palpate(object, true);
  IdentificationResult result;
  rt::ObjectModel& model = result.model;
  model.name = object;
  model.identified_on = "sim:phantom_1_5_high_force, six presses of 1-12 N and four taps, strokes of 2-4 N";
  if (current_plant() != sim::Plant::kSeparable) {
    model.identified_on += std::string(", plant ") + sim::name_of(current_plant());
  }
  for (const identification::PalpationSample& s : palpation) {
    if (!s.in_contact) continue;
    model.max_displacement_mm = std::max(model.max_displacement_mm, s.displacement_mm);
    model.max_force_n = std::max(model.max_force_n, s.normal_force_n);
  }
  model.hunt_crossley = value_of(identification::fit_hunt_crossley(palpation));
  model.creep = value_of(identification::fit_creep(palpation, 1000.0));
  const identification::FrictionFit friction =
      value_of(identification::fit_friction(stroke(object), {1.0, 0.0, 0.0}));
  model.rod_friction = friction.parameters;
  result.friction_error = friction.relative_error;

  result.dissertation.name = object;
  result.dissertation.hunt_crossley = value_of(identification::fit_hunt_crossley(palpate(object, false)));
  result.dissertation.rod_friction = friction.parameters;
  return result;
}

}  // namespace hapticd::study
