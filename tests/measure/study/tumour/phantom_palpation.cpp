#include "tests/measure/study/tumour/phantom_palpation.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/motion_estimator.h"
#include "rt/signal/tool_load.h"
#include "rt/signal/vector.h"
#include "server/identification/estimate/contact/contact_creep_fit.h"
#include "server/identification/gate/palpation_tracker.h"
#include "tests/measure/study/common/scenes.h"

namespace hapticd::study {

namespace {

constexpr double kReachMm = sim::PhantomParameters::kRadiusMm + sim::PhantomParameters::kTipRadiusMm;

/// A recursive scene watches: it needs no model, and rendering is off.
rt::SceneSpec watching_scene() {
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  scene.explore.displacement = rt::DisplacementEstimator::kRecursive;
  scene.target = rt::linear_target(0.0);
  return scene;
}

/// Presses as the tick places them: one begins where the force exceeds the threshold, and ends below half of
/// it.
std::vector<identification::Press> cut_into_presses(
    const std::vector<identification::PressSample>& recording) {
  constexpr double kThresholdN = 0.03;
  constexpr std::size_t kEvery = 20;  // of the samples of 1 kHz
  std::vector<identification::Press> presses;
  bool touching = false;
  std::size_t since = 0;
  std::optional<hal::Vector3> quiet_mm;
  for (const identification::PressSample& s : recording) {
    const double force_n = rt::norm(s.force_n);
    if (force_n < identification::Press::kQuietShare * kThresholdN) quiet_mm = s.tip_mm;
    if (!touching && force_n > kThresholdN) {
      touching = true;
      since = 0;
      presses.push_back({identification::surface_before(quiet_mm, s.tip_mm), {}});
    } else if (touching && force_n < 0.5 * kThresholdN) {
      touching = false;
    }
    if (touching && since++ % kEvery == 0) presses.back().samples.push_back(s);
  }
  std::erase_if(presses, [](const identification::Press& p) { return p.samples.size() < 3; });
  return presses;
}

/// The creep law of a palpation that begins on a rested object, and its error: rms of x̂/x - 1 beyond a tenth
/// of the deepest.
rt::IdentifiedLaw<rt::CreepParameters> creep_law_of(
    const std::vector<identification::PalpationSample>& palpation, double deepest_mm) {
  constexpr double kRateHz = 1000.0;
  identification::CreepFit fit(rt::CreepParameters{}.time_s);
  for (const identification::PalpationSample& s : palpation) fit.add(s, 1.0 / kRateHz);
  identification::CreepFit::Options options;
  options.fewest_samples = 100;
  options.with_errors = false;
  rt::IdentifiedLaw<rt::CreepParameters> law = fit.solve(options).value().law;
  rt::CreepLaw run(law.parameters, kRateHz);
  double sum = 0.0;
  double count = 0.0;
  for (const identification::PalpationSample& s : palpation) {
    const double estimated_mm = run.update(s.in_contact ? s.normal_force_n : 0.0).displacement_mm;
    if (!s.in_contact || s.displacement_mm < 0.1 * deepest_mm) continue;
    const double error = estimated_mm / s.displacement_mm - 1.0;
    sum += error * error;
    count += 1.0;
  }
  law.relative_error = std::clamp(std::sqrt(sum / count), 1e-3, 1.0);
  return law;
}

}  // namespace

double phantom_height_mm(double x_mm, double y_mm) {
  return std::sqrt(kReachMm * kReachMm - x_mm * x_mm - y_mm * y_mm) - kReachMm;
}

sim::SimulationConfig phantom_rig(const sim::ObjectModel& phantom) {
  sim::SimulationConfig rig = explore_rig("phantom_1_5_high_force", "phantom", "ball_bearing");
  rig.custom_object = phantom;
  return rig;
}

sim::ObjectModel phantom_object(const char* name) {
  return sim::object_preset(name).value();
}

sim::ObjectModel phantom_with_inclusion_at(double x_mm, double y_mm, double depth_mm,
                                           double stiffness_at_10mm_n_per_mm) {
  sim::ObjectModel object = phantom_object("phantom_hard");
  sim::PhantomInclusion& inclusion = object.phantom->inclusion.value();
  inclusion.stiffness_at_10mm_n_per_mm = stiffness_at_10mm_n_per_mm;
  inclusion.depth_mm = depth_mm;
  inclusion.axis = {x_mm / kReachMm, y_mm / kReachMm, (phantom_height_mm(x_mm, y_mm) + kReachMm) / kReachMm};
  return object;
}

std::vector<identification::Press> palpate_phantom(const sim::ObjectModel& phantom,
                                                   const std::vector<PhantomPress>& all) {
  VirtualRun run(phantom_rig(phantom), watching_scene(), false);
  rt::ThreeAxisMotion motion(run.info().device.position_resolution_mm, 1000.0);
  rt::ToolLoad load(kExploreToolMassG, {0.0, 0.0, -1.0});
  std::vector<identification::PressSample> recording;
  for (const PhantomPress& press : all) {
    press_phantom(run, press, [&] {
      const hal::RigSample& s = run.sample();
      motion.update(s.tip_position_mm, s.time_ns);
      const hal::Vector3 load_n = load.without_weight_n(s.sensor_force_n, s.tip_orientation);
      recording.push_back({s.tip_position_mm, motion.velocity_mm_per_s(),
                           load_n + load.inertia_n(motion.acceleration_mm_per_s2())});
    });
  }
  return cut_into_presses(recording);
}

const rt::ObjectModel& phantom_model() {
  static const rt::ObjectModel model = [] {
    const rt::SceneSpec scene = watching_scene();
    VirtualRun run(phantom_rig(phantom_object("phantom")), scene, false);
    identification::PalpationTracker tracker(scene.tool_mass_g, scene.contact.threshold_n,
                                             run.info().device.position_resolution_mm, run.info().rate_hz);
    std::vector<identification::PalpationSample> palpation;
    for (const PhantomPress& press : {PhantomPress{0.0, 0.0, 5.0, 20.0},
                                      {0.0, 0.0, 10.0, 60.0},
                                      {0.0, 0.0, 15.0, 30.0},
                                      {0.0, 0.0, 16.0, 100.0},
                                      {0.0, 0.0, 16.0, 10.0}}) {
      press_phantom(run, press, [&] { palpation.push_back(tracker.update(run.sample())); });
    }
    rt::ObjectModel found;
    found.name = "phantom";
    found.identified_on = "sim:phantom_1_5_high_force, five presses to 5 ... 16 mm";
    for (const identification::PalpationSample& s : palpation) {
      if (!s.in_contact) continue;
      found.max_displacement_mm = std::max(found.max_displacement_mm, s.displacement_mm);
      found.max_force_n = std::max(found.max_force_n, s.normal_force_n);
    }
    found.creep = creep_law_of(palpation, found.max_displacement_mm);
    return found;
  }();
  return model;
}

}  // namespace hapticd::study
