#include "server/scene/scene_file.h"

#include <fmt/format.h>

#include <array>
#include <optional>
#include <vector>

#include "server/scene/scene_assistance.h"
#include "server/scene/scene_friction_target.h"
#include "server/scene/scene_inclusions.h"
#include "server/scene/scene_transient.h"
#include "server/scene/scene_words.h"
#include "server/text/text_library.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

namespace {

constexpr Range kAxis{-1.0, 1.0, ""};
constexpr Range kTurnDeg{-180.0, 180.0, "°"};
constexpr Range kBiasN{-100.0, 100.0, "N"};
constexpr Range kToolMassG{0.0, 500.0, "g"};
constexpr Range kThresholdN{0.0, 5.0, "N"};  // 0 = the rig's
constexpr Range kReleaseRatio{0.0, 1.0, ""};
constexpr Range kReleaseTimeMs{0.1, 1000.0, "ms"};
constexpr Range kFreeTimeMs{0.1, 10000.0, "ms"};
constexpr Range kClearanceMm{0.0, 100.0, "mm"};
constexpr Range kBallRadiusMm{2.0, 500.0, "mm"};
constexpr Range kMapStepMm{0.5, 100.0, "mm"};
constexpr Range kMapColumns{2.0, 64.0, ""};
constexpr Range kPositionMm{-1000.0, 1000.0, "mm"};
constexpr Range kStiffness{0.0, 1000.0, "N/mm"};
constexpr Range kRampS{0.0, 60.0, "s"};
constexpr Range kTargetChange{1e-6, 1e6, "N/s"};
constexpr Range kStructural{0.0, 1e4, "N/mm"};
constexpr Range kGradient{-1.0, 1.0, "1/mm"};
constexpr Range kCurvature{-1.0, 1.0, "1/mm²"};
constexpr Range kProportional{0.0, 4.0, ""};
constexpr Range kDerivativeMs{0.0, 10.0, "ms"};
constexpr Range kForceN{0.0, 100.0, "N"};
constexpr Range kForceRate{0.0, 1e6, "N/s"};
constexpr Range kPowerW{0.0, 100.0, "W"};
constexpr Range kStaleMs{0.0, 1000.0, "ms"};
constexpr Range kForceNoiseN{1e-5, 1.0, "N"};
constexpr Range kCutoffHz{0.0, 5000.0, "Hz"};
constexpr Range kLeadMs{0.0, 50.0, "ms"};
constexpr Range kReactionLeadShare{0.0, 1.0, ""};
constexpr Range kPowerStiffness{0.0, 1000.0, "N/mm^m"};
constexpr Range kPowerDamping{0.0, rt::kMaxTargetDampingNsPerMm, "N·s/mm^(m+1)"};
constexpr Range kExponent{1.0, 3.0, ""};
constexpr std::size_t kMaxStationName = 64;

/// Refuses a key that only scenes of another kind use.
void refuse_foreign(TomlTable& table, std::string_view key, const std::string& shown,
                    const rt::SceneSpec& spec, std::string_view kinds) {
  table.refuse(key,
               hal::Error::of(hal::ErrorCode::kMisplacedKey,
                              fmt::format("'{}' means nothing in a scene of kind \"{}\"", shown,
                                          word_for(spec.kind, kKinds)),
                              "", "", fmt::format("kind = {}", kinds), "remove it, or choose such a kind"));
}

constexpr std::string_view kExploreOnly = "\"explore\"";

void read_contact(TomlTable& root, rt::SceneSpec& spec) {
  if (spec.kind == rt::SceneKind::kWall) {
    return refuse_foreign(root, "contact", "contact", spec, "\"tap_1d\" or \"explore\"");
  }
  TomlTable contact = root.table("contact");
  contact.read("method", spec.contact.method, kMethods);
  spec.contact.threshold_n = 0.0;  // the rig's
  contact.read("threshold_n", spec.contact.threshold_n, kThresholdN);
  contact.read("release_ratio", spec.contact.release_ratio, kReleaseRatio);
  contact.read("release_time_ms", spec.contact.release_time_ms, kReleaseTimeMs);
  contact.read("quiet_time_ms", spec.contact.quiet_time_ms, kFreeTimeMs);
  contact.read("arming_time_ms", spec.contact.arming_time_ms, kFreeTimeMs);
  contact.read("release_clearance_mm", spec.contact.release_clearance_mm, kClearanceMm);
  contact.read("unexplained_force_n", spec.contact.evidence.unexplained_force_n, kThresholdN);
  contact.read("lowest_stiffness_n_per_mm", spec.contact.evidence.lowest_stiffness_n_per_mm, kStiffness);
  contact.read("zero_bound_n", spec.contact.zero_bound_n, kThresholdN);
  if (explores(spec)) {
    contact.read("force_noise_n", spec.explore.force_noise_n, kForceNoiseN);
  } else {
    refuse_foreign(contact, "force_noise_n", "contact.force_noise_n", spec, kExploreOnly);
  }
}

/// Reads the compensations that keep the force at the hand correct while it moves.
void read_compensation(TomlTable& control, rt::SceneSpec& spec) {
  rt::CompensationParameters& c = spec.compensation;
  if (spec.kind == rt::SceneKind::kWall) {
    for (const char* key : {"reaction_lead_share", "back_drive_compensation"}) {
      refuse_foreign(control, key, "control." + std::string(key), spec, "\"tap_1d\" or \"explore\"");
    }
    return;
  }
  if (control.has("reaction_lead_share")) {
    control.read("reaction_lead_share", c.reaction_lead_share.emplace(), kReactionLeadShare);
  }
  control.read("back_drive_compensation", c.back_drive);
}

/// Reads the sections that only scenes of kind "explore" have.
void read_explore(TomlTable& root, rt::SceneSpec& spec) {
  if (!explores(spec)) {
    for (const char* section : {"direction", "friction", "displacement", "release", "passivity", "inclusion",
                                "friction_target", "transient"}) {
      refuse_foreign(root, section, section, spec, kExploreOnly);
    }
    return;
  }
  rt::ExploreParameters& explore = spec.explore;
  root.table("direction").read("method", explore.direction, kDirections);
  root.table("friction").read("feel", explore.friction_feel, kFeels);
  read_inclusions(root, spec);
  read_friction_target(root, spec);
  read_transient(root, spec);
  TomlTable displacement = root.table("displacement");
  displacement.read("estimator", explore.displacement, kEstimators);
  displacement.read("law", explore.law, kContactLaws);
  root.table("release").read("method", explore.release, kReleases);
  root.table("passivity").read("control", explore.passivity);
}

/// Reads the field about its centre, whose stiffness is structure.stiffness_n_per_mm.
void read_structural_field(TomlTable& structure, rt::SceneSpec& spec) {
  if (!structure.has("field")) return;
  TomlTable table = structure.table("field");
  rt::StructuralModel& field = spec.structural_field.emplace();
  table.read("centre_mm", field.centre_mm, kPositionMm);
  table.read("gradient_per_mm", field.gradient_per_mm, kGradient);
  table.read("curvature_per_mm2", field.curvature_per_mm2, kCurvature);
  table.read("covered_from_mm", field.covered_from_mm, kPositionMm);
  table.read("covered_to_mm", field.covered_to_mm, kPositionMm);
  field.stiffness_n_per_mm = spec.structural_stiffness_n_per_mm;
  if (field.stiffness_n_per_mm > 0.0) return;
  structure.refuse(
      "field",
      hal::Error::of(hal::ErrorCode::kMissingKey,
                     "'structure.field' says how the stiffness varies about its centre, and that is missing",
                     "", "", "structure.stiffness_n_per_mm above 0",
                     "say stiffness_n_per_mm in [structure], or leave out the field"));
}

/// Reads the keys of one law; those of the others are refused.
void read_target_law(TomlTable& target, rt::SceneSpec& spec) {
  using Kind = rt::TargetLaw::Kind;
  rt::TargetLaw& law = spec.target;
  target.read("law", law.kind, kTargetLaws);
  const auto of_law = [&](std::string_view key, bool belongs, std::string_view laws) {
    if (!belongs) {
      target.refuse(key,
                    hal::Error::of(hal::ErrorCode::kMisplacedKey,
                                   fmt::format("'target.{}' means nothing to the law \"{}\"", key,
                                               word_for(law.kind, kTargetLaws)),
                                   "", "", fmt::format("law = {}", laws), "remove it, or choose such a law"));
    }
    return belongs;
  };
  const bool is_tap = spec.kind == rt::SceneKind::kTap1d;
  if (law.kind != Kind::kLinear && is_tap) {
    target.refuse("law", hal::Error::of(hal::ErrorCode::kMisplacedKey,
                                        "scenes of kind tap_1d render linear targets only", "",
                                        std::string(word_for(law.kind, kTargetLaws)), "law = \"linear\"",
                                        "choose kind = \"explore\" or \"wall\" for other laws"));
    return;
  }
  if (of_law("stiffness_n_per_mm", law.kind == Kind::kLinear, "\"linear\"")) {
    target.read("stiffness_n_per_mm", law.stiffness_n_per_mm, kStiffness);
  }
  if (is_tap) return;
  if (of_law("hunt_crossley", law.kind == Kind::kHuntCrossley, "\"hunt_crossley\"")) {
    TomlTable power = target.table("hunt_crossley");
    power.read("stiffness_n_per_mm_m", law.hunt_crossley.stiffness_n_per_mm_m, kPowerStiffness);
    power.read("damping_n_s_per_mm_m1", law.hunt_crossley.damping_n_s_per_mm_m1, kPowerDamping);
    power.read("exponent", law.hunt_crossley.exponent, kExponent);
  }
  const bool by_position = law.kind == Kind::kPositionProfile;
  if (of_law("profile", by_position || law.kind == Kind::kDisplacementProfile,
             "\"displacement_profile\" or \"position_profile\"")) {
    std::vector<std::array<double, 2>> knots;
    target.read("profile", knots, {kPositionMm, kStiffness}, rt::TargetLaw::kMaxKnots);
    law.knot_count = static_cast<std::uint32_t>(knots.size());
    for (std::size_t i = 0; i < knots.size(); ++i) law.knots[i] = {knots[i][0], knots[i][1]};
  }
  if (of_law("axis", by_position, "\"position_profile\"")) target.read("axis", law.axis, kAxis);
}

}  // namespace

std::string_view word_of(rt::TargetLaw::Kind kind) {
  return word_for(kind, kTargetLaws);
}

std::string_view word_of(rt::Tip tip) {
  return word_for(tip, kTips);
}

hal::Result<rt::SceneSpec> parse_scene(std::string_view text, const std::string& source,
                                       const std::string& name) {
  auto document = TomlDocument::parse(text, source);
  if (!document) return document.error();

  rt::SceneSpec spec;
  TomlTable root = document->root();
  root.read("name", spec.name);
  root.read("kind", spec.kind, kKinds);
  root.read("description", spec.description);
  root.read("object_model", spec.object_model, kMaxModelName);
  root.read("turntable_station", spec.turntable_station, kMaxStationName);
  root.read("corrected_poses", spec.corrected_poses);
  if (explores(spec)) {
    refuse_foreign(root, "press_axis", "press_axis", spec, "\"tap_1d\" or \"wall\"");
  } else {
    root.read("press_axis", spec.press_axis, kAxis);
  }

  TomlTable tool = root.table("tool");
  tool.read("tip", spec.tip, kTips);
  if (explores(spec)) spec.tool_mass_g = 0.0;  // the rig's
  tool.read("mass_g", spec.tool_mass_g, kToolMassG);
  if (explores(spec)) {
    tool.read("gravity_at_bias", spec.explore.gravity_at_bias, kAxis);
    if (tool.has("sensor_turn_deg") || tool.has("sensor_bias_n")) {
      rt::SensorMounting& mounting = spec.explore.sensor_mounting.emplace();
      tool.read("sensor_turn_deg", mounting.turn_deg, kTurnDeg);
      tool.read("sensor_bias_n", mounting.force_bias_n, kBiasN);
    }
    if (tool.has("tip_to_centre_mm")) {
      tool.read("tip_to_centre_mm", spec.explore.tip_to_centre_mm.emplace(), kPositionMm);
    }
  } else {
    refuse_foreign(tool, "tip_to_centre_mm", "tool.tip_to_centre_mm", spec, kExploreOnly);
    refuse_foreign(tool, "sensor_turn_deg", "tool.sensor_turn_deg", spec, kExploreOnly);
    refuse_foreign(tool, "sensor_bias_n", "tool.sensor_bias_n", spec, kExploreOnly);
    refuse_foreign(tool, "gravity_at_bias", "tool.gravity_at_bias", spec, kExploreOnly);
  }

  read_contact(root, spec);
  if (spec.kind == rt::SceneKind::kWall) {
    TomlTable wall = root.table("wall");
    wall.read("position_mm", spec.wall_position_mm, kPositionMm);
    if (wall.has("ball_radius_mm")) {
      rt::BallParameters& ball = spec.wall_ball.emplace();
      wall.read("ball_radius_mm", ball.radius_mm, kBallRadiusMm);
      wall.read("ball_centre_mm", ball.centre_mm, kPositionMm);
    }
    if (wall.has("surface")) {
      rt::SurfaceMapParameters& map = spec.wall_map.emplace();
      constexpr std::size_t kMost = rt::SurfaceMapParameters::kMaxSide * rt::SurfaceMapParameters::kMaxSide;
      TomlTable surface = wall.table("surface");
      surface.read("from_mm", map.from_mm, kPositionMm);
      surface.read("step_mm", map.step_mm, kMapStepMm);
      surface.read("columns", map.columns, kMapColumns);
      surface.read("heights_mm", map.heights_mm, kPositionMm, kMost);
    }
  } else {
    refuse_foreign(root, "wall", "wall", spec, "\"wall\"");
  }
  read_explore(root, spec);

  TomlTable target = root.table("target");
  read_target_law(target, spec);
  if (explores(spec)) {
    target.read("modulated", spec.explore.modulated);
  } else {
    refuse_foreign(target, "modulated", "target.modulated", spec, kExploreOnly);
  }
  target.read("max_stiffness_n_per_mm", spec.max_target_stiffness_n_per_mm, kStiffness);
  target.read("ramp_s", spec.target_ramp_s, kRampS);
  target.read("max_change_n_per_s", spec.max_target_change_n_per_s, kTargetChange);

  TomlTable structure = root.table("structure");
  structure.read("compensation", spec.structural_compensation);
  structure.read("stiffness_n_per_mm", spec.structural_stiffness_n_per_mm, kStructural);

  read_structural_field(structure, spec);

  TomlTable control = root.table("control");
  control.read("law", spec.controller.law, kLaws);
  control.read("proportional_gain", spec.controller.proportional_gain, kProportional);
  control.read("derivative_gain_ms", spec.controller.derivative_gain_ms, kDerivativeMs);
  if (explores(spec)) {
    structure.read("cutoff_hz", spec.explore.deflection_cutoff_hz, kCutoffHz);
    control.read("lead_ms", spec.compensation.lead_ms, kLeadMs);
  } else {
    refuse_foreign(structure, "cutoff_hz", "structure.cutoff_hz", spec, kExploreOnly);
    refuse_foreign(control, "lead_ms", "control.lead_ms", spec, kExploreOnly);
  }
  read_compensation(control, spec);

  TomlTable guard = root.table("guard");
  guard.read("max_force_n", spec.guard.max_force_n, kForceN);
  guard.read("max_force_rate_n_per_s", spec.guard.max_force_rate_n_per_s, kForceRate);
  guard.read("max_power_w", spec.guard.max_power_w, kPowerW);
  guard.read("sensor_stale_after_ms", spec.guard.sensor_stale_after_ms, kStaleMs);
  guard.read("resume_ramp_s", spec.guard.resume_ramp_s, kRampS);
  guard.read("fall_ramp_s", spec.guard.fall_ramp_s, kRampS);
  guard.read("loop_gap_ms", spec.guard.loop_gap_ms, kStaleMs);
  read_assistance(root, spec);
  if (auto error = document->error()) return *error;

  const std::string where =
      root.has("name") ? fmt::format("{}, line {}", source, root.line_of("name")) : source;
  if (spec.name.empty() && !root.has("name")) {
    if (name.empty())
      return hal::Error::of(hal::ErrorCode::kMissingKey, "the scene has no name", where, "", "",
                            "add name = \"…\" at its top");
    spec.name = name;
  }
  if (auto error = check_name("scene", spec.name, where)) return *error;
  if (!name.empty() && spec.name != name) {
    return hal::Error::of(hal::ErrorCode::kContradiction, "the scene's name is not that of its file", where,
                          spec.name, name, "rename the one or the other");
  }
  return spec;
}

}  // namespace hapticd::server
