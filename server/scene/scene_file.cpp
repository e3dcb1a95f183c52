#include "server/scene/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "server/scene/scene_assistance.h"
#include "server/scene/scene_friction_target.h"
#include "server/scene/scene_inclusions.h"
#include "server/scene/scene_transient.h"
#include "server/scene/scene_words.h"
#include "server/text/text_library.h"
#include "server/text/toml_writer.h"

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
  table.refuse(
      key, hal::Error::of(
               hal::ErrorCode::kMisplacedKey,
               fmt::format("'{}' means nothing in a scene of kind \"{}\"", shown, text_of(spec.kind, kKinds)),
               "", "", fmt::format("kind = {}", kinds), "remove it, or choose such a kind"));
}

void refuse_foreign(TomlWriter&, const auto&...) {}

constexpr std::string_view kExploreOnly = "\"explore\"";

template <class Table>
void contact_fields(Table& root, auto& spec) {
  if (spec.kind == rt::SceneKind::kWall) {
    return refuse_foreign(root, "contact", "contact", spec, "\"tap_1d\" or \"explore\"");
  }
  auto contact = root.table("contact");
  contact.field("method", spec.contact.method, kMethods);
  if constexpr (Table::kReads) spec.contact.threshold_n = 0.0;  // the rig's
  contact.field("threshold_n", spec.contact.threshold_n, kThresholdN);
  contact.field("release_ratio", spec.contact.release_ratio, kReleaseRatio);
  contact.field("release_time_ms", spec.contact.release_time_ms, kReleaseTimeMs);
  contact.field("release_clearance_mm", spec.contact.release_clearance_mm, kClearanceMm);
  contact.field("quiet_time_ms", spec.contact.quiet_time_ms, kFreeTimeMs);
  contact.field("arming_time_ms", spec.contact.arming_time_ms, kFreeTimeMs);
  contact.field("unexplained_force_n", spec.contact.evidence.unexplained_force_n, kThresholdN);
  contact.field("lowest_stiffness_n_per_mm", spec.contact.evidence.lowest_stiffness_n_per_mm, kStiffness);
  contact.field("zero_bound_n", spec.contact.zero_bound_n, kThresholdN);
  if (explores(spec)) {
    contact.field("force_noise_n", spec.explore.force_noise_n, kForceNoiseN);
  } else {
    refuse_foreign(contact, "force_noise_n", "contact.force_noise_n", spec, kExploreOnly);
  }
}

/// The compensations that keep the force at the hand correct while it moves.
void compensation_fields(auto& control, auto& spec) {
  if (spec.kind == rt::SceneKind::kWall) {
    for (const char* key : {"reaction_lead_share", "back_drive_compensation"}) {
      refuse_foreign(control, key, "control." + std::string(key), spec, "\"tap_1d\" or \"explore\"");
    }
    return;
  }
  control.field("reaction_lead_share", spec.compensation.reaction_lead_share, kReactionLeadShare);
  control.field("back_drive_compensation", spec.compensation.back_drive);
}

/// The sections that only scenes of kind "explore" have, but for those of effects.
void explore_fields(auto& root, auto& spec) {
  if (!explores(spec)) {
    for (const char* section : {"direction", "friction", "displacement", "release", "passivity", "inclusion",
                                "friction_target", "transient"}) {
      refuse_foreign(root, section, section, spec, kExploreOnly);
    }
    return;
  }
  auto& explore = spec.explore;
  root.table("direction").field("method", explore.direction, kDirections);
  root.table("friction").field("feel", explore.friction_feel, kFeels);
  auto displacement = root.table("displacement");
  displacement.field("estimator", explore.displacement, kEstimators);
  displacement.field("law", explore.law, kContactLaws);
  root.table("release").field("method", explore.release, kReleases);
  root.table("passivity").field("control", explore.passivity);
}

/// The field about its centre, whose stiffness is structure.stiffness_n_per_mm.
template <class Table>
void structural_field(Table& structure, auto& spec) {
  structure.inline_table("field", spec.structural_field, [&](auto& table, auto& field) {
    table.field("centre_mm", field.centre_mm, kPositionMm);
    table.field("gradient_per_mm", field.gradient_per_mm, kGradient);
    table.field("curvature_per_mm2", field.curvature_per_mm2, kCurvature);
    table.field("covered_from_mm", field.covered_from_mm, kPositionMm);
    table.field("covered_to_mm", field.covered_to_mm, kPositionMm);
    if constexpr (Table::kReads) field.stiffness_n_per_mm = spec.structural_stiffness_n_per_mm;
  });
  if constexpr (Table::kReads) {
    if (!spec.structural_field || spec.structural_stiffness_n_per_mm > 0.0) return;
    structure.refuse(
        "field", hal::Error::of(
                     hal::ErrorCode::kMissingKey,
                     "'structure.field' says how the stiffness varies about its centre, and that is missing",
                     "", "", "structure.stiffness_n_per_mm above 0",
                     "say stiffness_n_per_mm in [structure], or leave out the field"));
  }
}

/// True for a key of the target's law; those of the others are refused.
bool is_of_law(TomlTable& target, const rt::TargetLaw& law, std::string_view key, bool belongs,
               std::string_view laws) {
  if (!belongs) {
    target.refuse(key,
                  hal::Error::of(hal::ErrorCode::kMisplacedKey,
                                 fmt::format("'target.{}' means nothing to the law \"{}\"", key,
                                             text_of(law.kind, kTargetLaws)),
                                 "", "", fmt::format("law = {}", laws), "remove it, or choose such a law"));
  }
  return belongs;
}
bool is_of_law(TomlWriter&, const rt::TargetLaw&, std::string_view, bool belongs, std::string_view) {
  return belongs;
}

template <class Table>
void target_law_fields(Table& target, auto& spec) {
  using Kind = rt::TargetLaw::Kind;
  auto& law = spec.target;
  const bool is_tap = spec.kind == rt::SceneKind::kTap1d;
  if (Table::kReads || !is_tap) target.field("law", law.kind, kTargetLaws);
  if constexpr (Table::kReads) {
    if (law.kind != Kind::kLinear && is_tap) {
      target.refuse("law", hal::Error::of(hal::ErrorCode::kMisplacedKey,
                                          "scenes of kind tap_1d render linear targets only", "",
                                          std::string(text_of(law.kind, kTargetLaws)), "law = \"linear\"",
                                          "choose kind = \"explore\" or \"wall\" for other laws"));
      return;
    }
  }
  if (is_of_law(target, law, "stiffness_n_per_mm", law.kind == Kind::kLinear, "\"linear\"")) {
    target.field("stiffness_n_per_mm", law.stiffness_n_per_mm, kStiffness);
  }
  if (is_tap) return;
  if (is_of_law(target, law, "hunt_crossley", law.kind == Kind::kHuntCrossley, "\"hunt_crossley\"")) {
    target.inline_table("hunt_crossley", [&](auto& power) {
      power.field("stiffness_n_per_mm_m", law.hunt_crossley.stiffness_n_per_mm_m, kPowerStiffness);
      power.field("damping_n_s_per_mm_m1", law.hunt_crossley.damping_n_s_per_mm_m1, kPowerDamping);
      power.field("exponent", law.hunt_crossley.exponent, kExponent);
    });
  }
  const bool by_position = law.kind == Kind::kPositionProfile;
  if (is_of_law(target, law, "profile", by_position || law.kind == Kind::kDisplacementProfile,
                "\"displacement_profile\" or \"position_profile\"")) {
    std::vector<std::array<double, 2>> knots;
    for (std::uint32_t i = 0; i < law.knot_count; ++i) {
      knots.push_back({law.knots[i].at_mm, law.knots[i].stiffness_n_per_mm});
    }
    target.field("profile", knots, std::array{kPositionMm, kStiffness}, rt::TargetLaw::kMaxKnots);
    if constexpr (Table::kReads) {
      law.knot_count = static_cast<std::uint32_t>(knots.size());
      for (std::size_t i = 0; i < knots.size(); ++i) law.knots[i] = {knots[i][0], knots[i][1]};
    }
  }
  if (is_of_law(target, law, "axis", by_position, "\"position_profile\"")) {
    target.field("axis", law.axis, kAxis);
  }
}

void heights_field(TomlTable& surface, rt::SurfaceMapParameters& map) {
  constexpr std::size_t kMost = rt::SurfaceMapParameters::kMaxSide * rt::SurfaceMapParameters::kMaxSide;
  surface.read("heights_mm", map.heights_mm, kPositionMm, kMost);
}
/// Writes a line for each row. A map without columns, which is refused later, gets one height in each.
void heights_field(TomlWriter& surface, const rt::SurfaceMapParameters& map) {
  const std::uint32_t columns = std::max<std::uint32_t>(1, map.columns);
  std::string rows;
  for (std::size_t i = 0; i < map.heights_mm.size(); ++i)
    rows += (i % columns == 0 ? "\n  " : " ") + toml_number(map.heights_mm[i]) + ',';
  surface.line("heights_mm", "[" + rows + "\n]");
}

template <class Table>
void wall_fields(Table& root, auto& spec) {
  if (spec.kind != rt::SceneKind::kWall) return refuse_foreign(root, "wall", "wall", spec, "\"wall\"");
  auto wall = root.table("wall");
  wall.field("position_mm", spec.wall_position_mm, kPositionMm);
  if constexpr (Table::kReads) {
    if (wall.has("ball_radius_mm")) spec.wall_ball.emplace();
  }
  if (spec.wall_ball) {
    wall.field("ball_radius_mm", spec.wall_ball->radius_mm, kBallRadiusMm);
    wall.field("ball_centre_mm", spec.wall_ball->centre_mm, kPositionMm);
  }
  wall.table("surface", spec.wall_map, [](auto& surface, auto& map) {
    surface.field("from_mm", map.from_mm, kPositionMm);
    surface.field("step_mm", map.step_mm, kMapStepMm);
    surface.field("columns", map.columns, kMapColumns);
    heights_field(surface, map);
  });
}

template <class Table>
void tool_fields(Table& root, auto& spec) {
  auto tool = root.table("tool");
  tool.field("tip", spec.tip, kTips);
  if constexpr (Table::kReads) {
    if (explores(spec)) spec.tool_mass_g = 0.0;  // the rig's
  }
  tool.field("mass_g", spec.tool_mass_g, kToolMassG);
  if (!explores(spec)) {
    for (const char* key : {"tip_to_centre_mm", "sensor_turn_deg", "sensor_bias_n", "gravity_at_bias"}) {
      refuse_foreign(tool, key, "tool." + std::string(key), spec, kExploreOnly);
    }
    return;
  }
  auto& explore = spec.explore;
  tool.field("gravity_at_bias", explore.gravity_at_bias, kAxis);
  if constexpr (Table::kReads) {
    if (tool.has("sensor_turn_deg") || tool.has("sensor_bias_n")) explore.sensor_mounting.emplace();
  }
  if (explore.sensor_mounting) {
    tool.field("sensor_turn_deg", explore.sensor_mounting->turn_deg, kTurnDeg);
    tool.field("sensor_bias_n", explore.sensor_mounting->force_bias_n, kBiasN);
  }
  tool.field("tip_to_centre_mm", explore.tip_to_centre_mm, kPositionMm);
}

template <class Table>
void scene_fields(Table& root, auto& spec) {
  root.field("name", spec.name);
  root.field("kind", spec.kind, kKinds);
  root.field("description", spec.description);
  root.field("object_model", spec.object_model, kMaxModelName);
  root.field("turntable_station", spec.turntable_station, kMaxStationName);
  root.field("corrected_poses", spec.corrected_poses);
  if (explores(spec)) {
    refuse_foreign(root, "press_axis", "press_axis", spec, "\"tap_1d\" or \"wall\"");
  } else {
    root.field("press_axis", spec.press_axis, kAxis);
  }
  tool_fields(root, spec);
  wall_fields(root, spec);
  contact_fields(root, spec);
  explore_fields(root, spec);

  auto target = root.table("target");
  target_law_fields(target, spec);
  target.field("max_stiffness_n_per_mm", spec.max_target_stiffness_n_per_mm, kStiffness);
  target.field("ramp_s", spec.target_ramp_s, kRampS);
  target.field("max_change_n_per_s", spec.max_target_change_n_per_s, kTargetChange);
  if (!explores(spec)) {
    refuse_foreign(target, "modulated", "target.modulated", spec, kExploreOnly);
  } else if (Table::kReads || !spec.explore.modulated) {
    target.field("modulated", spec.explore.modulated);
  }

  auto structure = root.table("structure");
  structure.field("compensation", spec.structural_compensation);
  structure.field("stiffness_n_per_mm", spec.structural_stiffness_n_per_mm, kStructural);
  if (explores(spec)) {
    structure.field("cutoff_hz", spec.explore.deflection_cutoff_hz, kCutoffHz);
  } else {
    refuse_foreign(structure, "cutoff_hz", "structure.cutoff_hz", spec, kExploreOnly);
  }
  structural_field(structure, spec);

  auto control = root.table("control");
  control.field("law", spec.controller.law, kLaws);
  control.field("proportional_gain", spec.controller.proportional_gain, kProportional);
  control.field("derivative_gain_ms", spec.controller.derivative_gain_ms, kDerivativeMs);
  if (explores(spec)) {
    control.field("lead_ms", spec.compensation.lead_ms, kLeadMs);
  } else {
    refuse_foreign(control, "lead_ms", "control.lead_ms", spec, kExploreOnly);
  }
  compensation_fields(control, spec);

  auto guard = root.table("guard");
  guard.field("max_force_n", spec.guard.max_force_n, kForceN);
  guard.field("max_force_rate_n_per_s", spec.guard.max_force_rate_n_per_s, kForceRate);
  guard.field("max_power_w", spec.guard.max_power_w, kPowerW);
  guard.field("sensor_stale_after_ms", spec.guard.sensor_stale_after_ms, kStaleMs);
  guard.field("resume_ramp_s", spec.guard.resume_ramp_s, kRampS);
  guard.field("fall_ramp_s", spec.guard.fall_ramp_s, kRampS);
  guard.field("loop_gap_ms", spec.guard.loop_gap_ms, kStaleMs);
}

}  // namespace

std::string_view word_of(rt::TargetLaw::Kind kind) {
  return text_of(kind, kTargetLaws);
}

std::string_view word_of(rt::Tip tip) {
  return text_of(tip, kTips);
}

hal::Result<rt::SceneSpec> parse_scene(std::string_view text, const std::string& source,
                                       const std::string& name) {
  auto document = TomlDocument::parse(text, source);
  if (!document) return document.error();

  rt::SceneSpec spec;
  TomlTable root = document->root();
  scene_fields(root, spec);
  if (explores(spec)) {
    read_inclusions(root, spec);
    read_friction_target(root, spec);
    read_transient(root, spec);
  }
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

std::string write_scene(const rt::SceneSpec& spec) {
  return toml_fields([&](TomlWriter& root) { scene_fields(root, spec); }) + inclusions_text(spec) +
         friction_target_text(spec) + transient_text(spec) + assistance_text(spec);
}

}  // namespace hapticd::server
