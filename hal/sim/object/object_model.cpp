#include "hal/sim/object/object_model.h"

#include <cmath>
#include <numbers>

#include "hal/sim/object/general_object_model.h"

namespace hapticd::sim {

namespace {

// Stiffness at 4 N: D§3.2.2 and D§3.4.1 (0.38 sponge block, 0.59 rubber ball, 2.26 the stiffest and most
// linear of the four, the eraser), D§4.7 (0.18 sponge cut, 0.33 foam ball). The text gives none for the first
// foam ball
// ("a mild stiffness curve", between sponge and rubber), the second rubber ball and the silicone rest:
// assumed. Curve shapes: D§3.2.2 (sponge most non-linear with significant hysteresis, eraser most linear),
// D§4.6.2 (sponge cut 5 mm at 0.5 N), D§4.7.3 (it densifies near 25 mm). Shares and times of the branches,
// skins, radii and friction: assumed, within what soft-tissue and foam literature reports; none was fitted to
// a result of this project. The dissertation has no sticky gel and no ridge: they are extremes, one for
// stick-slip, one for a surface whose normal turns within millimetres.
// Ball bearing: 0.0643 and 2.44e-4 N·s/mm were identified on average (D§4.4.1), too low on sponge, foam and
// rubber and too high on silicone (D§4.4.3): hence the levels; the viscosity is given that size at 2 N.
// Hardly any static friction and irregular rolling: D§4.4.1. The rest of it, and how far any friction
// ripples: assumed.
std::vector<ObjectModel> make_presets() {
  std::vector<ObjectModel> all;
  const auto add = [&all](std::string name, Shape shape, MaterialParameters material,
                          FrictionParameters friction, FrictionParameters friction_bearing) {
    all.push_back({std::move(name), shape, material, friction, friction_bearing});
    all.back().general_material = general_material_of(all.back().name);
  };
  const auto uneven = [&all](double share, double wavelength_mm) {
    all.back().inhomogeneity_share = share;
    all.back().inhomogeneity_wavelength_mm = wavelength_mm;
  };
  const auto material = [](double k4, double a, double b, double c, double onset,
                           std::array<RelaxationBranch, 3> branches, double skin_k, double skin_c,
                           double skin_d) {
    return MaterialParameters{k4, a, b, c, onset, branches, skin_k, skin_c, skin_d};
  };
  const std::array<RelaxationBranch, 3> sponge{{{0.20, 0.008}, {0.20, 0.15}, {0.25, 3.0}}};
  const std::array<RelaxationBranch, 3> foam{{{0.12, 0.006}, {0.12, 0.12}, {0.12, 2.5}}};
  const std::array<RelaxationBranch, 3> rubber{{{0.10, 0.004}, {0.06, 0.10}, {0.06, 2.0}}};
  const std::array<RelaxationBranch, 3> eraser{{{0.08, 0.004}, {0.04, 0.10}, {0.04, 2.0}}};
  const std::array<RelaxationBranch, 3> silicone{{{0.10, 0.005}, {0.08, 0.20}, {0.10, 3.0}}};
  const std::array<RelaxationBranch, 3> wood{{{0.03, 0.001}, {0.01, 0.05}, {0.0, 1.0}}};
  //                       k4    a     b     c     onset          skin: N/mm  N·s/mm  mm
  const auto sponge_block = material(0.38, 0.25, 0.15, 0.60, 0.35, sponge, 0.10, 4e-4, 0.15);
  const auto foam_ball = material(0.45, 0.45, 0.55, 0.0, 0.5, foam, 0.15, 5e-4, 0.12);
  const auto rubber_ball = material(0.59, 0.55, 0.45, 0.0, 0.5, rubber, 0.20, 1e-3, 0.10);
  const auto rubber_eraser = material(2.26, 0.90, 0.10, 0.0, 0.5, eraser, 0.30, 2e-3, 0.06);
  const auto sponge_cut = material(0.18, 0.45, 0.25, 0.30, 0.50, sponge, 0.08, 3e-4, 0.20);
  const auto foam_ball_3d = material(0.33, 0.45, 0.55, 0.0, 0.5, foam, 0.15, 5e-4, 0.12);
  const auto silicone_rest = material(0.50, 0.75, 0.25, 0.0, 0.5, silicone, 0.20, 1e-3, 0.10);
  const auto gel = material(0.50, 0.60, 0.40, 0.0, 0.5, silicone, 0.15, 1e-3, 0.15);
  const auto wood_plate = material(50.0, 1.0, 0.0, 0.0, 0.5, wood, 1.0, 1e-2, 0.02);
  //                                   μ_k   μ_s/μ_k v_s presliding viscous damping ripple: share, mm
  const FrictionParameters on_sponge{0.55, 1.10, 5.0, 0.40, 2e-4, 5e-5, 0.04, 2.5};
  const FrictionParameters on_foam{0.60, 1.15, 5.0, 0.30, 1e-4, 5e-5, 0.04, 2.5};
  const FrictionParameters on_rubber{0.80, 1.25, 4.0, 0.20, 1e-4, 5e-5, 0.04, 2.5};
  const FrictionParameters on_silicone{0.70, 1.40, 3.0, 0.25, 1e-4, 5e-5, 0.04, 2.5};
  const FrictionParameters on_wood{0.35, 1.20, 5.0, 0.02, 5e-5, 2e-5, 0.02, 2.5};
  const FrictionParameters on_gel{1.20, 2.20, 8.0, 0.30, 1e-4, 5e-5, 0.04, 2.5};
  const auto rolling = [](double kinetic) {
    return FrictionParameters{kinetic, 1.03, 5.0, 0.05, 1.2e-4, 5e-5, 0.10, 4.0};
  };
  const FrictionParameters over_sponge = rolling(0.075);
  const FrictionParameters over_foam = rolling(0.075);
  const FrictionParameters over_rubber = rolling(0.070);
  const FrictionParameters over_silicone = rolling(0.050);
  const FrictionParameters over_wood = rolling(0.045);

  add("sponge_block", Plane{}, sponge_block, on_sponge, over_sponge);
  add("foam_ball", Sphere{35.0}, foam_ball, on_foam, over_foam);
  add("rubber_ball", Sphere{30.0}, rubber_ball, on_rubber, over_rubber);
  add("rubber_eraser", Plane{}, rubber_eraser, on_rubber, over_rubber);
  add("sponge_cut", WavyField{1.5, 45.0}, sponge_cut, on_sponge, over_sponge);
  uneven(0.06, 25.0);
  add("foam_ball_3d", Sphere{50.0}, foam_ball_3d, on_foam, over_foam);
  uneven(0.04, 30.0);
  add("rubber_ball_3d", Sphere{40.0}, rubber_ball, on_rubber, over_rubber);
  uneven(0.02, 40.0);
  add("silicone_rest", WavyField{2.0, 80.0}, silicone_rest, on_silicone, over_silicone);
  uneven(0.04, 35.0);
  add("wood_plate", Plane{}, wood_plate, on_wood, over_wood);
  add("sticky_gel", Plane{}, gel, on_gel, over_silicone);
  add("foam_ridge", Ridge{3.0}, foam_ball_3d, on_foam, over_foam);

  // The breast phantoms of D§5: without a tumour, with the hard and with the soft one. Their matter is a
  // separate body (phantom_body.h); what `material` says of them is not used. The ball that presses them
  // touches a sphere of both radii.
  const Sphere phantom{PhantomParameters::kRadiusMm + PhantomParameters::kTipRadiusMm};
  const auto add_phantom = [&](const char* name, std::optional<PhantomInclusion> inclusion) {
    add(name, phantom, silicone_rest, on_silicone, over_silicone);
    all.back().phantom.emplace().inclusion = inclusion;
  };
  add_phantom("phantom", std::nullopt);
  add_phantom("phantom_hard", PhantomInclusion{.stiffness_at_10mm_n_per_mm = 0.54});
  add_phantom("phantom_soft", PhantomInclusion{.stiffness_at_10mm_n_per_mm = 0.21});
  return all;
}

const std::vector<ObjectModel>& presets() {
  static const std::vector<ObjectModel> all = make_presets();
  return all;
}

}  // namespace

double ObjectModel::stiffness_scale(const hal::Vector3& surface_point_mm) const noexcept {
  if (inhomogeneity_share == 0.0) return 1.0;
  const double k = 2.0 * std::numbers::pi / inhomogeneity_wavelength_mm;
  return 1.0 + inhomogeneity_share * std::sin(k * surface_point_mm.x) * std::cos(k * surface_point_mm.y);
}

std::optional<ObjectModel> object_preset(const std::string& name) {
  for (const ObjectModel& model : presets()) {
    if (model.name == name) return model;
  }
  return std::nullopt;
}

std::vector<std::string> object_preset_names() {
  std::vector<std::string> names;
  for (const ObjectModel& model : presets()) names.push_back(model.name);
  return names;
}

std::optional<Tip> tip_named(const std::string& name) {
  if (name == "rod") return Tip::kRod;
  if (name == "ball_bearing") return Tip::kBallBearing;
  return std::nullopt;
}

std::vector<std::string> tip_names() {
  return {"rod", "ball_bearing"};
}

}  // namespace hapticd::sim
