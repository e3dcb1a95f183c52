#include <fmt/format.h>

#include <string>

#include "server/scene/scene_assistance.h"
#include "server/scene/scene_file.h"
#include "server/scene/scene_friction_target.h"
#include "server/scene/scene_inclusions.h"
#include "server/scene/scene_transient.h"
#include "server/scene/scene_words.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

template <class E, std::size_t N>
std::string quoted_word(E value, const Word<E> (&words)[N]) {
  return toml_quoted(word_for(value, words));
}

std::string structural_field_text(const rt::StructuralModel& field) {
  std::string curvature;
  for (const double h : field.curvature_per_mm2)
    curvature += (curvature.empty() ? "" : ", ") + toml_number(h);
  return fmt::format(
      "field = {{ centre_mm = {}, gradient_per_mm = {}, curvature_per_mm2 = [{}], covered_from_mm = {}, "
      "covered_to_mm = {} }}\n",
      toml_vector(field.centre_mm), toml_vector(field.gradient_per_mm), curvature,
      toml_vector(field.covered_from_mm), toml_vector(field.covered_to_mm));
}

std::string target_law_text(const rt::TargetLaw& law, bool other_laws) {
  using Kind = rt::TargetLaw::Kind;
  std::string text = other_laws ? fmt::format("law = {}\n", quoted_word(law.kind, kTargetLaws)) : "";
  switch (law.kind) {
    case Kind::kLinear:
      return text + fmt::format("stiffness_n_per_mm = {}\n", toml_number(law.stiffness_n_per_mm));
    case Kind::kHuntCrossley:
      return text + fmt::format(
                        "hunt_crossley = {{ stiffness_n_per_mm_m = {}, damping_n_s_per_mm_m1 = {}, "
                        "exponent = {} }}\n",
                        toml_number(law.hunt_crossley.stiffness_n_per_mm_m),
                        toml_number(law.hunt_crossley.damping_n_s_per_mm_m1),
                        toml_number(law.hunt_crossley.exponent));
    case Kind::kDisplacementProfile:
    case Kind::kPositionProfile:
      break;
  }
  std::string knots;
  for (std::uint32_t i = 0; i < law.knot_count; ++i) {
    knots += fmt::format("{}[{}, {}]", i == 0 ? "" : ", ", toml_number(law.knots[i].at_mm),
                         toml_number(law.knots[i].stiffness_n_per_mm));
  }
  text += fmt::format("profile = [{}]\n", knots);
  if (law.kind == Kind::kPositionProfile) text += fmt::format("axis = {}\n", toml_vector(law.axis));
  return text;
}

}  // namespace

std::string write_scene(const rt::SceneSpec& spec) {
  const auto number = [](double value) { return toml_number(value); };
  const bool explore = explores(spec);
  std::string text = fmt::format(
      "name = {}\nkind = {}\ndescription = {}\nobject_model = {}\nturntable_station = {}\n"
      "corrected_poses = {}\n",
      toml_quoted(spec.name), quoted_word(spec.kind, kKinds), toml_quoted(spec.description),
      toml_quoted(spec.object_model), toml_quoted(spec.turntable_station), spec.corrected_poses);
  if (!explore) text += fmt::format("press_axis = {}\n", toml_vector(spec.press_axis));
  text += fmt::format("\n[tool]\ntip = {}\nmass_g = {}\n", quoted_word(spec.tip, kTips),
                      number(spec.tool_mass_g));
  if (explore) text += fmt::format("gravity_at_bias = {}\n", toml_vector(spec.explore.gravity_at_bias));
  if (explore && spec.explore.sensor_mounting) {
    text += fmt::format("sensor_turn_deg = {}\nsensor_bias_n = {}\n",
                        toml_vector(spec.explore.sensor_mounting->turn_deg),
                        toml_vector(spec.explore.sensor_mounting->force_bias_n));
  }
  if (explore && spec.explore.tip_to_centre_mm) {
    text += fmt::format("tip_to_centre_mm = {}\n", toml_vector(*spec.explore.tip_to_centre_mm));
  }
  if (spec.kind == rt::SceneKind::kWall) {
    text += fmt::format("\n[wall]\nposition_mm = {}\n", number(spec.wall_position_mm));
    if (spec.wall_ball) {
      text += fmt::format("ball_radius_mm = {}\nball_centre_mm = {}\n", number(spec.wall_ball->radius_mm),
                          toml_vector(spec.wall_ball->centre_mm));
    }
    if (spec.wall_map) {
      const rt::SurfaceMapParameters& map = *spec.wall_map;
      text += fmt::format("\n[wall.surface]\nfrom_mm = [{}, {}]\nstep_mm = {}\ncolumns = {}\nheights_mm = [",
                          number(map.from_mm[0]), number(map.from_mm[1]), number(map.step_mm), map.columns);
      for (std::size_t i = 0; i < map.heights_mm.size(); ++i)
        text += (i % map.columns == 0 ? "\n  " : " ") + number(map.heights_mm[i]) + ',';
      text += "\n]\n";
    }
  } else {
    text += fmt::format(
        "\n[contact]\nmethod = {}\nthreshold_n = {}\nrelease_ratio = {}\nrelease_time_ms = {}\n"
        "release_clearance_mm = {}\nquiet_time_ms = {}\narming_time_ms = {}\n"
        "unexplained_force_n = {}\nlowest_stiffness_n_per_mm = {}\nzero_bound_n = {}\n",
        quoted_word(spec.contact.method, kMethods), number(spec.contact.threshold_n),
        number(spec.contact.release_ratio), number(spec.contact.release_time_ms),
        number(spec.contact.release_clearance_mm), number(spec.contact.quiet_time_ms),
        number(spec.contact.arming_time_ms), number(spec.contact.evidence.unexplained_force_n),
        number(spec.contact.evidence.lowest_stiffness_n_per_mm), number(spec.contact.zero_bound_n));
  }
  if (explore) {
    const rt::ExploreParameters& e = spec.explore;
    text += fmt::format(
        "force_noise_n = {}\n\n[direction]\nmethod = {}\n\n[friction]\nfeel = {}\n\n[displacement]\n"
        "estimator = {}\nlaw = {}\n\n[release]\nmethod = {}\n\n[passivity]\ncontrol = {}\n",
        number(e.force_noise_n), quoted_word(e.direction, kDirections), quoted_word(e.friction_feel, kFeels),
        quoted_word(e.displacement, kEstimators), quoted_word(e.law, kContactLaws),
        quoted_word(e.release, kReleases), e.passivity);
  }
  text += fmt::format("\n[target]\n{}max_stiffness_n_per_mm = {}\nramp_s = {}\nmax_change_n_per_s = {}\n",
                      target_law_text(spec.target, spec.kind != rt::SceneKind::kTap1d),
                      number(spec.max_target_stiffness_n_per_mm), number(spec.target_ramp_s),
                      number(spec.max_target_change_n_per_s));
  if (explore && !spec.explore.modulated) text += "modulated = false\n";
  text += fmt::format("\n[structure]\ncompensation = {}\nstiffness_n_per_mm = {}\n",
                      spec.structural_compensation, number(spec.structural_stiffness_n_per_mm));
  if (explore) text += fmt::format("cutoff_hz = {}\n", number(spec.explore.deflection_cutoff_hz));
  if (spec.structural_field) text += structural_field_text(*spec.structural_field);
  text += fmt::format("\n[control]\nlaw = {}\nproportional_gain = {}\nderivative_gain_ms = {}\n",
                      quoted_word(spec.controller.law, kLaws), number(spec.controller.proportional_gain),
                      number(spec.controller.derivative_gain_ms));
  if (spec.kind != rt::SceneKind::kWall) {
    const rt::CompensationParameters& c = spec.compensation;
    if (explore) text += fmt::format("lead_ms = {}\n", number(c.lead_ms));
    if (c.reaction_lead_share)
      text += fmt::format("reaction_lead_share = {}\n", number(*c.reaction_lead_share));
    text += fmt::format("back_drive_compensation = {}\n", c.back_drive);
  }
  text += fmt::format(
      "\n[guard]\nmax_force_n = {}\nmax_force_rate_n_per_s = {}\nmax_power_w = {}\nsensor_stale_after_ms = "
      "{}\n"
      "resume_ramp_s = {}\nfall_ramp_s = {}\nloop_gap_ms = {}\n",
      number(spec.guard.max_force_n), number(spec.guard.max_force_rate_n_per_s),
      number(spec.guard.max_power_w), number(spec.guard.sensor_stale_after_ms),
      number(spec.guard.resume_ramp_s), number(spec.guard.fall_ramp_s), number(spec.guard.loop_gap_ms));
  text += inclusions_text(spec);
  text += friction_target_text(spec);
  text += transient_text(spec);
  text += assistance_text(spec);
  return text;
}

}  // namespace hapticd::server
