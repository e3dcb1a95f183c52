#include "rt/scene/scene_spec.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "rt/control/default_gains.h"
#include "rt/scene/compose.h"
#include "rt/scene/effects.h"
#include "rt/scene/watched_tool.h"
#include "rt/target/desired_force.h"
#include "rt/target/largest_target.h"

namespace hapticd::rt {

namespace {

constexpr double kMinThresholdN = 0.005;
constexpr double kFullScaleTimeS = 0.005;  // from zero to full force; faster is a knock, not a feel
constexpr double kMinForceRate = 1.0;      // N/s

/// Names what is wrong with one value of a scene.
class Checker {
 public:
  explicit Checker(const SceneSpec& spec) : scene_("scene '" + spec.name + "'") {}

  /// NaN fails every range.
  void range(const char* key, double value, double low, double high, const char* unit) {
    if (error_ || (value >= low && value <= high)) return;
    fail(key, value, number(low) + " … " + number(high) + " " + unit, "");
  }
  void fail(const std::string& key, double value, const std::string& limit, const std::string& remedy) {
    if (!error_)
      error_ = hal::Error::of(hal::ErrorCode::kOutOfRange, key + " is out of range", scene_, number(value),
                              limit, remedy);
  }
  const std::optional<hal::Error>& error() const { return error_; }

  static std::string number(double value) {
    std::ostringstream text;
    text << value;
    return text.str();
  }

 private:
  std::string scene_;
  std::optional<hal::Error> error_;
};

void check_vector(Checker& check, const std::string& key, const hal::Vector3& value, double bound,
                  const char* unit) {
  check.range((key + ".x").c_str(), value.x, -bound, bound, unit);
  check.range((key + ".y").c_str(), value.y, -bound, bound, unit);
  check.range((key + ".z").c_str(), value.z, -bound, bound, unit);
}

void check_field(Checker& check, const StructuralModel& field, double stiffness_n_per_mm) {
  check.range("structure.field's stiffness", field.stiffness_n_per_mm, stiffness_n_per_mm, stiffness_n_per_mm,
              "N/mm (structure.stiffness_n_per_mm, that of its centre)");
  check_vector(check, "structure.field.centre_mm", field.centre_mm, 1e3, "mm");
  check_vector(check, "structure.field.gradient_per_mm", field.gradient_per_mm, 1.0, "1/mm");
  for (const double h : field.curvature_per_mm2) {
    check.range("structure.field.curvature_per_mm2", h, -1.0, 1.0, "1/mm²");
  }
  check_vector(check, "structure.field.covered_from_mm", field.covered_from_mm, 1e3, "mm");
  check_vector(check, "structure.field.covered_to_mm", field.covered_to_mm, 1e3, "mm");
  for (const hal::Vector3& corner : field.corners_mm()) {
    check.range("structure.field's compliance at a corner of what it covers",
                field.relative_compliance(corner), 1.0 / StructuralModel::kMaxRatio,
                StructuralModel::kMaxRatio,
                "times that of its centre (structures vary less; check gradient, curvature and units)");
  }
}

void check_map(Checker& check, const SceneSpec& spec) {
  using Map = SurfaceMapParameters;
  const Map& map = *spec.wall_map;
  const auto fail = [&check](const char* key, double value, const char* limit, const char* remedy) {
    check.fail(key, value, limit, remedy);
  };
  check.range("wall.surface.step_mm", map.step_mm, 0.5, 100.0, "mm");
  check.range("wall.surface.from_mm[0]", map.from_mm[0], -1000.0, 1000.0, "mm");
  check.range("wall.surface.from_mm[1]", map.from_mm[1], -1000.0, 1000.0, "mm");
  if (map.columns < Map::kMinSide || map.columns > Map::kMaxSide)
    return fail("wall.surface.columns", map.columns, "2 … 64", "scan with another step");
  if (map.heights_mm.size() % map.columns != 0 || map.rows() < Map::kMinSide || map.rows() > Map::kMaxSide)
    return fail("wall.surface.heights_mm, their number", static_cast<double>(map.heights_mm.size()),
                "2 … 64 whole rows of so many columns", "give all rows");
  constexpr double kSteepest = 2.0;
  for (std::size_t i = 0; i < map.heights_mm.size(); ++i) {
    check.range("wall.surface.heights_mm", map.heights_mm[i], -1000.0, 1000.0, "mm");
    const double aside = i % map.columns == 0 ? 0.0 : map.heights_mm[i] - map.heights_mm[i - 1];
    const double below = i < map.columns ? 0.0 : map.heights_mm[i] - map.heights_mm[i - map.columns];
    if (std::max(std::abs(aside), std::abs(below)) > kSteepest * map.step_mm)
      return fail(
          "wall.surface.heights_mm, a step between neighbours", std::max(std::abs(aside), std::abs(below)),
          "twice step_mm: steeper is no surface that is pressed from above", "remove outliers of the scan");
  }
  if (spec.wall_ball)
    fail("wall.ball_radius_mm", spec.wall_ball->radius_mm, "one of the two",
         "remove the ball, or the surface");
  if (std::abs(spec.press_axis.z + 1.0) > 1e-9)
    fail("press_axis", spec.press_axis.z, "[0, 0, -1] with a scanned surface", "remove press_axis");
}

}  // namespace

double softest_structure_n_per_mm(const SceneSpec& resolved) noexcept {
  double softest = resolved.structural_stiffness_n_per_mm;
  if (!resolved.structural_field) return softest;
  for (const hal::Vector3& corner : resolved.structural_field->corners_mm()) {
    softest = std::min(softest, resolved.structural_field->stiffness_at(corner));
  }
  return softest;
}

hal::Result<SceneSpec> resolve(SceneSpec spec, const hal::RigInfo& rig) {
  const hal::DeviceInfo& device = rig.device;
  const bool uses_sensor = spec.kind != SceneKind::kWall;
  const bool explores = spec.kind == SceneKind::kExplore;

  // What the scene leaves to the device.
  if (!spec.compensation.reaction_lead_share) {
    constexpr double kLeadShare = 0.9;
    spec.compensation.reaction_lead_share = spec.kind == SceneKind::kWall ? 0.0 : kLeadShare;
  }
  if (spec.structural_stiffness_n_per_mm == 0.0) {
    spec.structural_stiffness_n_per_mm = device.structural_stiffness_n_per_mm;
  }
  if (!(spec.structural_stiffness_n_per_mm > 0.0)) spec.structural_compensation = false;  // a rigid device
  if (spec.contact.threshold_n == 0.0) {
    spec.contact.threshold_n = explores ? 0.02 : 0.015;  // three axes of noise, and a tool that tilts
  }
  if (spec.contact.evidence.unexplained_force_n == 0.0) {
    spec.contact.evidence.unexplained_force_n = default_unexplained_force_n(spec.contact.threshold_n);
  }
  if (spec.controller.proportional_gain == 0.0) {
    const ControllerParameters gains = default_gains(device.model);
    spec.controller.proportional_gain = gains.proportional_gain;
    if (spec.controller.derivative_gain_ms == 0.0)
      spec.controller.derivative_gain_ms = gains.derivative_gain_ms;
  }
  if (spec.max_target_stiffness_n_per_mm == 0.0) {
    spec.max_target_stiffness_n_per_mm = spec.kind == SceneKind::kWall
                                             ? default_largest_wall_n_per_mm(device.model)
                                             : largest_target_n_per_mm(device);
  }
  if (spec.guard.max_force_n == 0.0) spec.guard.max_force_n = device.max_force_n;
  if (spec.guard.max_force_rate_n_per_s == 0.0) {
    spec.guard.max_force_rate_n_per_s = std::max(kMinForceRate, spec.guard.max_force_n / kFullScaleTimeS);
  }
  if (!uses_sensor) spec.guard.sensor_stale_after_ms = 0.0;
  if (explores && spec.tool_mass_g == 0.0) spec.tool_mass_g = rig.sensor.tool_mass_g;
  spec.guard.renders_real_object = uses_sensor && rig.renders_force;

  Checker check(spec);
  const hal::Vector3 axis = spec.press_axis;
  const double length = std::sqrt(dot(axis, axis));
  if (!(length > 1e-6) || !std::isfinite(length)) {
    check.fail("press_axis", length, "a finite vector of some length", "give a direction such as [0, 0, -1]");
  } else {
    spec.press_axis = axis * (1.0 / length);
  }
  check.range("tool.mass_g", spec.tool_mass_g, 0.0, 500.0, "g");
  check.range("contact.threshold_n", spec.contact.threshold_n, kMinThresholdN, 5.0,
              "N (less is within the noise of a tick's mean)");
  // Beyond these a contact that is held is ended and begun again at full force, many times a second.
  check.range("contact.lowest_stiffness_n_per_mm", spec.contact.evidence.lowest_stiffness_n_per_mm, 0.002,
              0.1, "N/mm (softer objects than that would be let go)");
  check.range("contact.unexplained_force_n", spec.contact.evidence.unexplained_force_n,
              2.0 * spec.contact.threshold_n, 5.0, "N (no less than twice contact.threshold_n)");
  if (spec.contact.zero_bound_n != 0.0) {
    check.range("contact.zero_bound_n", spec.contact.zero_bound_n, spec.contact.threshold_n, 1.0,
                "N (no less than contact.threshold_n; 0: the zero is not followed)");
  }
  check.range("contact.release_ratio", spec.contact.release_ratio, 0.0, 0.8, "(fraction of the threshold)");
  check.range("contact.release_time_ms", spec.contact.release_time_ms, 2.0, 1000.0, "ms");
  check.range("contact.release_clearance_mm", spec.contact.release_clearance_mm, 0.1, 50.0, "mm");
  check.range("contact.quiet_time_ms", spec.contact.quiet_time_ms, 20.0, 10000.0, "ms");
  check.range("contact.arming_time_ms", spec.contact.arming_time_ms, 5.0, 10000.0, "ms");
  check.range("wall.position_mm", spec.wall_position_mm, -1000.0, 1000.0, "mm");
  if (spec.wall_ball) check.range("wall.ball_radius_mm", spec.wall_ball->radius_mm, 2.0, 500.0, "mm");
  if (spec.wall_map) check_map(check, spec);
  check.range("target.max_stiffness_n_per_mm", spec.max_target_stiffness_n_per_mm, 0.0, 1000.0, "N/mm");
  if (auto error = rt::check(spec.target, "scene '" + spec.name + "', [target]")) return *error;
  if (spec.kind == SceneKind::kTap1d && spec.target.kind != TargetLaw::Kind::kLinear) {
    check.fail("target.law", 0.0, "\"linear\"", "scenes of kind tap_1d render linear targets only");
  }
  check.range("target's stiffness", greatest_stiffness_n_per_mm(spec.target, kMaxTargetDepthMm), 0.0,
              spec.max_target_stiffness_n_per_mm, "N/mm (target.max_stiffness_n_per_mm)");
  check.range("target.ramp_s", spec.target_ramp_s, 0.0, 60.0, "s");
  check.range("target.max_change_n_per_s", spec.max_target_change_n_per_s, 1e-6, 1e6, "N/s");
  if (spec.structural_compensation) {
    check.range("structure.stiffness_n_per_mm", spec.structural_stiffness_n_per_mm, 0.01, 1e4, "N/mm");
    if (spec.structural_field) {
      check_field(check, *spec.structural_field, spec.structural_stiffness_n_per_mm);
    }
    if (!explores) {
      check.range("target.stiffness_n_per_mm", greatest_stiffness_n_per_mm(spec.target, kMaxTargetDepthMm),
                  0.0, kMaxCompensableRatio * softest_structure_n_per_mm(spec),
                  "N/mm (0.8 of the structural stiffness, as far as it can be compensated)");
    }
  }
  if (uses_sensor) {
    const CompensationParameters& c = spec.compensation;
    if (explores) check.range("control.lead_ms", c.lead_ms, 0.0, 50.0, "ms");
    check.range("control.reaction_lead_share", c.reaction_lead_share.value_or(0.0), 0.0, 1.0,
                "(fraction of the loop's delay; more takes damping out of a contact)");
  }
  if (explores) {
    const ExploreParameters& e = spec.explore;
    if (spec.tool_mass_g == 0.0) {
      check.fail("tool.mass_g", 0.0, "the mass beyond the sensor, in g",
                 "the rig does not know it: weigh the tool and give it, or its weight is taken for contact");
    }
    check.range("structure.cutoff_hz", e.deflection_cutoff_hz, 0.0, 0.4 * rig.rate_hz, "Hz (0: at once)");
    check.range("contact.force_noise_n", e.force_noise_n, 1e-5, 1.0, "N");
    const double gravity = std::sqrt(dot(e.gravity_at_bias, e.gravity_at_bias));
    check.range("tool.gravity_at_bias, its length", gravity, 1e-6, 1e6, "(a direction)");
    if (gravity > 0.0) spec.explore.gravity_at_bias = e.gravity_at_bias * (1.0 / gravity);
    if (e.tip_to_centre_mm) {
      check.range("tool.tip_to_centre_mm, its length", norm(*e.tip_to_centre_mm), 0.0, 1e3, "mm");
    }
    if (e.sensor_mounting) {
      check.range("tool.sensor_turn_deg, its length", norm(e.sensor_mounting->turn_deg), 0.0, 180.0, "deg");
      check.range("tool.sensor_bias_n, its length", norm(e.sensor_mounting->force_bias_n), 0.0, 100.0, "N");
    }
  }
  check.range("guard.max_force_n", spec.guard.max_force_n, 0.0, device.max_force_n,
              "N (the device's own limit)");
  constexpr double kRounding = 1.0 + 1e-9;
  check.range("guard.max_force_rate_n_per_s", spec.guard.max_force_rate_n_per_s, kMinForceRate,
              kRounding * device.max_force_n / kFullScaleTimeS,
              "N/s (the device's own force within 5 ms; faster is a knock)");
  check.range("guard.max_power_w", spec.guard.max_power_w, 0.0, 100.0, "W");
  check.range("guard.resume_ramp_s", spec.guard.resume_ramp_s, 0.0, 60.0, "s");
  check.range("guard.fall_ramp_s", spec.guard.fall_ramp_s, 0.0, 1.0, "s");
  check.range("guard.loop_gap_ms", spec.guard.loop_gap_ms, 0.0, 1000.0, "ms (0 = any)");
  if (uses_sensor)
    check.range("guard.sensor_stale_after_ms", spec.guard.sensor_stale_after_ms, 0.1, 1000.0, "ms");
  if (!(spec.controller.derivative_gain_ms >= 0.0)) {
    check.fail("control.derivative_gain_ms", spec.controller.derivative_gain_ms, "0 ms or more",
               "a negative one goes on pushing once the error has turned; 0.015 ms suits most devices");
  } else if (!gains_are_stable(spec.controller, rig.rate_hz)) {
    check.fail(
        "control.proportional_gain", spec.controller.proportional_gain,
        "Kp > 0, |Kd'| < 1 and Kp + 2 Kd' < 2, with Kd' = derivative_gain_ms / period_ms",
        "outside this region the controller oscillates by itself; 0.45 and 0.015 ms suit most devices");
  } else if (!spec.seeks_ultimate_gain && !gains_settle(spec.controller, rig.rate_hz)) {
    check.fail("control.proportional_gain", spec.controller.proportional_gain,
               "Kp ≥ " + Checker::number(1.0 / (rig.rate_hz * kMaxControllerTimeS)) +
                   " (a time constant of 20 ms), and poles that ring no longer than 0.75 a sample",
               "a slower controller goes on pushing after the object was left, one with more of "
               "derivative_gain_ms rings; 0.45 and 0.015 ms suit most devices");
  }
  if (check.error()) return *check.error();
  spec.guard.tool = watched_tool(spec, rig);
  return spec;
}

namespace {

void outline_explore(const SceneSpec& spec, std::vector<std::string>& stages) {
  const ExploreParameters& e = spec.explore;
  const bool bearing = spec.tip == Tip::kBallBearing;
  const bool tracked = e.direction == DirectionMethod::kTracked;
  stages.emplace_back("motion: adaptive-window velocity, 50 Hz Butterworth acceleration, three axes");
  stages.emplace_back(e.tip_to_centre_mm
                          ? "tool compensation: gravity, inertia of its centre in any orientation (4.5)-(4.8)"
                          : "tool compensation: gravity and inertia in any orientation (4.5)-(4.8)");
  stages.emplace_back("contact: force threshold with release hysteresis, force by the evidence of an object");
  stages.emplace_back(bearing ? "friction: Coulomb-viscous, ball bearing (4.11)"
                              : "friction: solid rod, by its model: Dahl (4.12)-(4.15) or Maxwell-slip, "
                                "exact and scaled by the load");
  stages.emplace_back(tracked ? "direction: normal and friction distinguished by when they change (Kalman)"
                              : "direction: (4.16)-(4.20), 70 Hz Butterworth");
  const std::string law = e.law == ContactLawKind::kCreep ? "creep law" : "inverse Hunt-Crossley law (4.23)";
  switch (e.displacement) {
    case DisplacementEstimator::kFused:
      stages.push_back("displacement: way and " + law + ", weighed by their variances");
      break;
    case DisplacementEstimator::kInverse:
      stages.push_back("displacement: " + law + " of the 60 Hz filtered force");
      break;
    case DisplacementEstimator::kRecursive:
      stages.emplace_back("displacement: recursive (4.21)");
      break;
  }
  if (spec.structural_compensation) {
    stages.emplace_back(spec.structural_field
                            ? "structural deflection (4.25) where the tip is, below the loop's own speed"
                            : "structural deflection (4.25), below the loop's own speed");
  }
  stages.emplace_back(e.friction_feel == FrictionFeel::kKept ? "target force: along the normal, friction kept"
                                                             : "target force (4.4), friction cancelled");
  if (!e.modulated) stages.back() = "target force: none, the object as it is";
  for (const Effect& effect : effects()) {
    if (effect.is_asked_for(spec)) stages.push_back(effect.stage(spec));
  }
}

void outline_compensation(const SceneSpec& spec, std::vector<std::string>& stages) {
  const CompensationParameters& c = spec.compensation;
  if (spec.kind == SceneKind::kExplore && c.lead_ms > 0.0)
    stages.push_back("prediction: displacement " + Checker::number(c.lead_ms) + " ms ahead");
  if (const double share = c.reaction_lead_share.value_or(0.0); share > 0.0) {
    const char* displacement = spec.kind == SceneKind::kTap1d ? ", and displacement" : "";
    stages.push_back("prediction: reaction, below 40 Hz" + std::string(displacement) + ", by " +
                     Checker::number(share) + " of the loop's delay");
  }
  if (c.back_drive) stages.emplace_back("back-drive compensation: the device's own dry friction");
}

}  // namespace

AssistanceSpec assistance_of(const SceneSpec& resolved) {
  return {resolved.press_axis, resolved.fixture, resolved.watch};
}

SceneOutline outline(const SceneSpec& spec) {
  SceneOutline result;
  result.hardware = {"haptic device"};
  result.models = needed_models(spec);
  result.channels = channel::kSample | channel::kContact | channel::kDeformation | channel::kTarget |
                    channel::kControl | channel::kGuard | channel::kTiming;
  switch (spec.kind) {
    case SceneKind::kTap1d:
      result.stages = {"motion: adaptive-window velocity, 50 Hz Butterworth acceleration",
                       "tool compensation: inertia (3.4)",
                       "contact: force threshold with release hysteresis, force by the evidence of an object",
                       "displacement: from the contact point along the press axis"};
      break;
    case SceneKind::kWall:
      result.stages = {spec.wall_map    ? "contact: position against the scanned surface"
                       : spec.wall_ball ? "contact: position against the ball"
                                        : "contact: position against the wall"};
      if (spec.wall_ball || spec.wall_map) result.channels |= channel::kDirection;
      break;
    case SceneKind::kExplore:
      outline_explore(spec, result.stages);
      result.channels |= channel::kDirection;
      if (spec.explore.displacement == DisplacementEstimator::kFused) result.channels |= channel::kFusion;
      for (const Effect& effect : effects()) {
        if (effect.is_asked_for(spec)) result.channels |= effect.channels;
      }
      break;
  }
  if (spec.kind != SceneKind::kWall) {
    result.hardware.emplace_back("force sensor");
    result.channels |= channel::kMotion | channel::kZero;
  }
  if (!spec.turntable_station.empty()) result.hardware.emplace_back("turntable");
  if (spec.corrected_poses) {
    result.stages.emplace(result.stages.begin(), "pose: corrected by the arm's adopted calibration");
  }
  if (spec.kind != SceneKind::kExplore) {
    result.stages.emplace_back(spec.structural_compensation
                                   ? "target force (3.3), structural compensation solved implicitly"
                                   : "target force (3.3), device taken as rigid");
  }
  const std::string axes = spec.kind == SceneKind::kExplore ? ", three axes (4.24)" : " (3.6)";
  result.stages.push_back(spec.controller.law == ControlLaw::kClosedLoop ? "controller: closed loop" + axes
                                                                         : "controller: open loop");
  if (spec.kind != SceneKind::kWall) outline_compensation(spec, result.stages);
  if (spec.kind != SceneKind::kWall) result.stages.emplace_back("feasible range (3.8)");
  if (spec.fixture) {
    result.stages.push_back("fixture: walls above the contact point and " +
                            Checker::number(spec.fixture->corridor_mm) + " mm from its line, " +
                            Checker::number(spec.fixture->max_force_n) + " N at most");
  }
  if (spec.watch) result.stages.emplace_back("watch: what makes a presentation valid");
  if (spec.fixture || spec.watch) result.channels |= channel::kAssist;
  result.stages.emplace_back("guard: finite, force, rate, power, stale sensor");
  return result;
}

}  // namespace hapticd::rt
