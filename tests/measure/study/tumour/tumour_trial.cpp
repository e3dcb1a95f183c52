#include "tests/measure/study/tumour/tumour_trial.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "tests/measure/study/common/scenes.h"
#include "tests/support/value_of.h"

namespace hapticd::study {

namespace {

using test::value_of;

constexpr double kSphereDepthMm = 25.0;

/// One press by a run that is there; the force at the hand is what sensor and device give (D§5.4).
PressCurve press_with(VirtualRun& run, const PhantomPress& press) {
  PressCurve curve;
  const double surface_mm = phantom_height_mm(press.x_mm, press.y_mm);
  double last = 0.0, before = 0.0;
  hal::Vector3 tip_before = run.truth().tip_position_mm;
  bool first = true;
  press_phantom(run, press, [&] {
    const hal::TruthSample& truth = run.truth();
    const hal::Vector3 device = truth.device_force_n;
    const double device_n = std::sqrt(dot(device, device));
    const double up_n = run.record().inclusion_force_n.z;
    if (!first) {
      curve.largest_jump_n = std::max(curve.largest_jump_n, std::abs(up_n - 2.0 * last + before));
      curve.energy_n_mm -= dot(truth.reaction_force_n + device, truth.tip_position_mm - tip_before);
    }
    first = false;
    tip_before = truth.tip_position_mm;
    before = last;
    last = up_n;
    curve.largest_force_n = std::max(curve.largest_force_n, device_n);
    if (!truth.in_contact) return;
    curve.depth_mm.push_back(surface_mm - truth.tip_position_mm.z);
    curve.force_n.push_back(truth.reaction_force_n.z + device.z);
  });
  return curve;
}

std::size_t deepest(const PressCurve& curve) {
  return static_cast<std::size_t>(std::max_element(curve.depth_mm.begin(), curve.depth_mm.end()) -
                                  curve.depth_mm.begin());
}

}  // namespace

rt::SceneSpec inclusion_scene(const std::vector<rt::InclusionParameters>& inclusions) {
  rt::SceneSpec scene = explore_scene(rt::Tip::kBallBearing);
  scene.name = "tumour";
  scene.explore.modulated = false;
  // Motors that overcome their own friction would count as force at the hand.
  scene.compensation.back_drive = false;
  scene.inclusions = inclusions;
  return scene;
}

PressCurve press_real(const char* phantom, const PhantomPress& press) {
  VirtualRun run(phantom_rig(phantom_object(phantom)), inclusion_scene({}), false, &phantom_model());
  return press_with(run, press);
}

PressCurve press_rendered(const std::vector<rt::InclusionParameters>& inclusions, const PhantomPress& press) {
  VirtualRun run(phantom_rig(phantom_object("phantom")), inclusion_scene(inclusions), true, &phantom_model());
  return press_with(run, press);
}

double curve_error(const PressCurve& rendered, const PressCurve& real) {
  constexpr double kFromMm = 1.0;
  const std::size_t end = deepest(rendered);
  const std::size_t real_end = deepest(real);
  double difference = 0.0, size = 0.0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < end; ++i) {
    const double depth = rendered.depth_mm[i];
    if (depth < kFromMm || depth > real.depth_mm[real_end]) continue;
    at = 0;
    while (at + 1 < real_end && real.depth_mm[at + 1] < depth) ++at;
    const double step = real.depth_mm[at + 1] - real.depth_mm[at];
    const double share = step > 0.0 ? std::clamp((depth - real.depth_mm[at]) / step, 0.0, 1.0) : 0.0;
    const double true_n = real.force_n[at] + share * (real.force_n[at + 1] - real.force_n[at]);
    difference += (rendered.force_n[i] - true_n) * (rendered.force_n[i] - true_n);
    size += true_n * true_n;
  }
  return std::sqrt(difference / std::max(1e-9, size));
}

std::vector<PhantomPress> scan_presses(double reach_mm, double spacing_mm, double depth_mm) {
  std::vector<PhantomPress> all;
  const int n = static_cast<int>(std::floor(reach_mm / spacing_mm));
  for (int i = -n; i <= n; ++i) {
    for (int j = -n; j <= n; ++j) {
      if (spacing_mm * std::hypot(i, j) > reach_mm + 1e-9) continue;
      all.push_back({spacing_mm * i, spacing_mm * j, depth_mm, 60.0});
    }
  }
  return all;
}

const IdentifiedTumour& identified_tumour(const char* phantom) {
  static std::map<std::string, IdentifiedTumour> known;
  const auto found = known.find(phantom);
  if (found != known.end()) return found->second;
  IdentifiedTumour tumour;
  std::vector<PhantomPress> presses;
  for (const double speed : {20.0, 50.0, 100.0}) presses.push_back({0.0, 0.0, 13.0, speed});
  tumour.by_pair = value_of(identification::fit_inclusion_response(
      palpate_phantom(phantom_object("phantom"), presses), palpate_phantom(phantom_object(phantom), presses),
      kSphereDepthMm));
  tumour.by_pair.inclusion.variant = rt::InclusionVariant::kPublished;
  const auto scan = scan_presses(24.0, 8.0, 13.0);
  tumour.by_scan = value_of(identification::fit_inclusion_scan(
      palpate_phantom(phantom_object("phantom"), scan), palpate_phantom(phantom_object(phantom), scan), {},
      {sim::PhantomParameters::kTipRadiusMm, 0.0}));
  return known.emplace(phantom, tumour).first->second;
}

}  // namespace hapticd::study
