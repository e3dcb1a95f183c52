#include "server/scene/scene_models.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rt/control/force_controller.h"
#include "rt/signal/tool_load.h"
#include "rt/signal/vector.h"

namespace hapticd::server {

namespace {

constexpr double kNoticedTiltDeg = 2.0;

bool is_under(const rt::ToolModel& tool, const ZeroInForce& zero) {
  return !zero.identity.empty() && tool.found_under_bias == zero.identity;
}

/// The greatest depth at which a target changes; 0 if it is the same everywhere.
double deepest_mm(const rt::TargetLaw& target) {
  if (target.kind != rt::TargetLaw::Kind::kDisplacementProfile) return 0.0;
  double deepest = 0.0;
  for (std::uint32_t i = 0; i < target.knot_count; ++i) deepest = std::max(deepest, target.knots[i].at_mm);
  return deepest;
}

/// " ± 0.05", if it is known.
std::string error_text(const StoredModel& stored, std::string_view parameter) {
  for (const rt::EstimatedParameter& p : stored.model.parameters) {
    if (p.name == parameter && std::isfinite(p.standard_error)) {
      return fmt::format(" ± {:.2g}", p.standard_error);
    }
  }
  return {};
}

/// Greatest deviation of a field's compliance from that of its centre, at the corners of the identified box.
double spread(const rt::StructuralModel& structure) {
  double largest = 0.0;
  for (const hal::Vector3& at : structure.corners_mm()) {
    largest = std::max(largest, std::abs(structure.stiffness_at(at) / structure.stiffness_n_per_mm - 1.0));
  }
  return largest;
}

/// Fills in the values one by one, with a remark on each.
class Filling {
 public:
  Filling(rt::SceneSpec& scene, const hal::RigInfo& rig, const ZeroInForce& zero, RigModelUse& use)
      : scene_(scene), rig_(rig), zero_(zero), use_(use) {}

  /// Fills in how the tool was held when the sensor was biased, unless the scene sets it itself.
  void gravity_at_bias() {
    const rt::ExploreParameters defaults;
    const hal::Vector3& said = scene_.explore.gravity_at_bias;
    if (!zero_.gravity || rt::norm(said - defaults.gravity_at_bias) > 0.0) return;
    scene_.explore.gravity_at_bias = *zero_.gravity;
    const double tilt_deg = std::acos(std::clamp(-zero_.gravity->z, -1.0, 1.0)) * 57.29577951308232;
    if (tilt_deg < kNoticedTiltDeg) return;
    use_.remarks.push_back(fmt::format(
        "tool.gravity_at_bias: the tool was tilted by {:.2g}° when the sensor was biased", tilt_deg));
  }

  void tool(const StoredModel& stored) {
    const auto& tool = std::get<rt::ToolModel>(stored.model.content);
    scene_.tool_mass_g = tool.mass_g;
    std::string more;
    if (!scene_.explore.sensor_mounting) {
      const rt::SensorMounting mounting = mounting_of(tool, scene_.explore.gravity_at_bias, zero_);
      scene_.explore.sensor_mounting = mounting;
      const double turn_deg = rt::norm(mounting.turn_deg);
      more = is_under(tool, zero_)
                 ? fmt::format("; with the sensor's bias of {:.3g} N and its seat, turned by {:.2g}°",
                               rt::norm(mounting.force_bias_n), turn_deg)
                 : fmt::format(
                       "; with the sensor's seat, turned by {:.2g}°; without its bias, for it was found "
                       "under another bias of the sensor ({}); 'hapticctl identify tool' finds it again",
                       turn_deg, tool.found_under_bias.value_or("not known which"));
    }
    if (tool.tip_to_centre_mm && !scene_.explore.tip_to_centre_mm) {
      scene_.explore.tip_to_centre_mm = tool.tip_to_centre_mm;
      more += fmt::format("; its centre {:.3g} mm from the tip", rt::norm(*tool.tip_to_centre_mm));
    }
    used(stored, fmt::format("tool.mass_g = {:.4g}{} g", tool.mass_g, error_text(stored, "mass_g")), more);
  }
  void structure(const StoredModel& stored) {
    const auto& structure = std::get<rt::StructuralModel>(stored.model.content);
    scene_.structural_stiffness_n_per_mm = structure.stiffness_n_per_mm;
    std::string more;
    if (const double strays = spread(structure); strays > 0.0) {
      scene_.structural_field = structure;
      more =
          fmt::format("; a field, taken where the tip is: up to {:.2g} % off its centre's", 100.0 * strays);
    }
    used(stored,
         fmt::format("structure.stiffness_n_per_mm = {:.4g}{} N/mm", structure.stiffness_n_per_mm,
                     error_text(stored, "structural_stiffness_n_per_mm")),
         more);
  }
  void threshold(const StoredModel& stored) {
    const auto& threshold = std::get<rt::ThresholdModel>(stored.model.content);
    const std::string said = fmt::format("contact.threshold_n = {:.4g} N", threshold.threshold_n);
    const double zero_bound_n = scene_.contact.zero_bound_n;
    if (zero_bound_n != 0.0 && threshold.threshold_n > zero_bound_n) {
      use_.remarks.push_back(fmt::format(
          "{} of stored model {} not used: more than contact.zero_bound_n, {:g} N; something was touched while it "
          "was identified, or the sensor is too noisy",
          said, stored.short_hash(), zero_bound_n));
      return;
    }
    scene_.contact.threshold_n = threshold.threshold_n;
    used(stored, said,
         fmt::format("; no false alarm in {:.0f} s of free motion", threshold.observed_s));
  }
  void gains(const StoredModel& stored) {
    const auto& gains = std::get<rt::GainsModel>(stored.model.content);
    rt::ControllerParameters tried = scene_.controller;
    tried.proportional_gain = gains.proportional_gain;
    if (tried.derivative_gain_ms == 0.0) tried.derivative_gain_ms = gains.derivative_ms;
    const std::string said = fmt::format("control.proportional_gain = {:.4g}, derivative_gain_ms = {:.4g}",
                                         tried.proportional_gain, tried.derivative_gain_ms);
    if (!rt::gains_settle(tried, rig_.rate_hz)) {
      const bool is_stable = rt::gains_are_stable(tried, rig_.rate_hz);
      use_.remarks.push_back(fmt::format("{} of stored model {} not used: {} at {:g} Hz", said,
                                         stored.short_hash(),
                                         is_stable ? "slower than 20 ms, or ringing," : "unstable",
                                         rig_.rate_hz));
      return;
    }
    scene_.controller = tried;
    used(stored, said, "");
  }

 private:
  void used(const StoredModel& stored, const std::string& value, const std::string& more) {
    use_.stored.push_back(stored.hash);
    use_.remarks.push_back(fmt::format("{}: from stored model {}{}{}", value, stored.short_hash(),
                                       stored.model.converged ? "" : ", which had not converged", more));
  }

  rt::SceneSpec& scene_;
  const hal::RigInfo& rig_;
  const ZeroInForce& zero_;
  RigModelUse& use_;
};

}  // namespace

std::vector<std::string> cautions(const StoredModel& stored, const rt::SceneSpec& scene,
                                  const hal::RigInfo& rig) {
  const rt::IdentifiedModel& model = stored.model;
  std::vector<std::string> all;
  if (!model.converged) all.emplace_back("had not converged");
  if (rig.kind == hal::RigKind::kHardware && stored.rig_kind == "simulated") {
    all.emplace_back("identified on a simulated rig");
  }
  if (model.device.empty()) {
    all.emplace_back("it is not known on which device it was identified");
  } else if (model.device != rig.device.model) {
    all.push_back("identified on another device: " + model.device + " instead of " + rig.device.model);
  }
  if (!model.sensor.empty() && model.sensor != rig.sensor.model) {
    all.push_back("identified with another sensor: " + model.sensor + " instead of " + rig.sensor.model);
  }
  const double covered_mm = model.validity.max_displacement_mm;
  const double asked_mm = deepest_mm(scene.target);
  if (covered_mm > 0.0 && asked_mm > covered_mm) {
    all.push_back(
        fmt::format("identified down to {:.3g} mm only, the target goes to {:.3g} mm", covered_mm, asked_mm));
  }
  return all;
}

rt::SensorMounting mounting_of(const rt::ToolModel& tool, const hal::Vector3& gravity_at_bias,
                               const ZeroInForce& zero) {
  rt::SensorMounting mounting{rt::turn_deg_of(tool.sensor_to_tool), tool.force_bias_n};
  if (is_under(tool, zero)) return mounting;
  // In the orientation of the bias the reading is zero: turn (0 - bias) is its weight there.
  const hal::Vector3 weight_n =
      gravity_at_bias * rt::inertial_force_n(tool.mass_g, rt::ToolLoad::kGravityMmPerS2);
  mounting.force_bias_n = rt::rotated(rt::conjugate(rt::unit(tool.sensor_to_tool)), weight_n) * -1.0;
  return mounting;
}

RigModelUse use_rig_models(const RigModels& models, rt::SceneSpec& scene, const hal::RigInfo& rig,
                           const ZeroInForce& zero) {
  RigModelUse use;
  Filling fill(scene, rig, zero, use);
  const bool explores = scene.kind == rt::SceneKind::kExplore;
  if (explores) fill.gravity_at_bias();
  if (models.tool && explores && scene.tool_mass_g == 0.0) fill.tool(*models.tool);
  if (models.structure && scene.structural_compensation && scene.structural_stiffness_n_per_mm == 0.0) {
    fill.structure(*models.structure);
  }
  if (models.threshold && scene.kind != rt::SceneKind::kWall && scene.contact.threshold_n == 0.0) {
    fill.threshold(*models.threshold);
  }
  if (models.gains && scene.controller.law == rt::ControlLaw::kClosedLoop &&
      scene.controller.proportional_gain == 0.0) {
    fill.gains(*models.gains);
  }
  return use;
}

}  // namespace hapticd::server
