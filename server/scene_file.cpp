#include "server/scene_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/toml_reader.h"

namespace hapticd::server {

namespace {

constexpr Range kAxis{-1.0, 1.0, ""};
constexpr Range kToolMassG{0.0, 500.0, "g"};
constexpr Range kThresholdN{1e-4, 5.0, "N"};
constexpr Range kReleaseRatio{0.0, 1.0, ""};
constexpr Range kReleaseTicks{1.0, 1000.0, "ticks"};
constexpr Range kFreeTicks{1.0, 10000.0, "ticks"};
constexpr Range kClearanceMm{0.0, 100.0, "mm"};
constexpr Range kPositionMm{-1000.0, 1000.0, "mm"};
constexpr Range kStiffness{0.0, 1000.0, "N/mm"};
constexpr Range kRampS{0.0, 60.0, "s"};
constexpr Range kStructural{0.0, 1e4, "N/mm"};
constexpr Range kProportional{0.0, 4.0, ""};
constexpr Range kDerivativeMs{-10.0, 10.0, "ms"};
constexpr Range kForceN{0.0, 100.0, "N"};
constexpr Range kForceRate{0.0, 1e6, "N/s"};
constexpr Range kPowerW{0.0, 100.0, "W"};
constexpr Range kStaleMs{0.0, 1000.0, "ms"};
constexpr std::size_t kLongestName = 64;

constexpr Word<rt::SceneKind> kKinds[] = {{"tap_1d", rt::SceneKind::kTap1d}, {"wall", rt::SceneKind::kWall}};
constexpr Word<rt::ContactMethod> kMethods[] = {
    {"matched_inertia", rt::ContactMethod::kMatchedInertia},
    {"filtered_acceleration", rt::ContactMethod::kFilteredAcceleration}};
constexpr Word<rt::ControlLaw> kLaws[] = {{"closed_loop", rt::ControlLaw::kClosedLoop},
                                          {"open_loop", rt::ControlLaw::kOpenLoop}};

template <class E, std::size_t N>
std::string word_for(E value, const Word<E> (&words)[N]) {
  for (const Word<E>& word : words) {
    if (word.value == value) return toml_quoted(word.text);
  }
  return toml_quoted(words[0].text);
}

bool name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

}  // namespace

std::optional<hal::Error> check_scene_name(std::string_view name, std::string_view where) {
  if (!name.empty() && name.size() <= kLongestName && std::all_of(name.begin(), name.end(), name_character)) {
    return std::nullopt;
  }
  return hal::Error{"not a name for a scene", std::string(where), std::string(name.substr(0, kLongestName)),
                    "1 … 64 of a-z A-Z 0-9 _ -", "choose such a name"};
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
  root.read("object_model", spec.object_model, kLongestName);
  root.read("press_axis", spec.press_axis, kAxis);

  TomlTable tool = root.table("tool");
  tool.read("tip", spec.tip, kLongestName);
  tool.read("mass_g", spec.tool_mass_g, kToolMassG);

  TomlTable contact = root.table("contact");
  contact.read("method", spec.contact.method, kMethods);
  contact.read("threshold_n", spec.contact.threshold_n, kThresholdN);
  contact.read("release_ratio", spec.contact.release_ratio, kReleaseRatio);
  contact.read("release_ticks", spec.contact.release_ticks, kReleaseTicks);
  contact.read("quiet_ticks_after_release", spec.contact.quiet_ticks_after_release, kFreeTicks);
  contact.read("free_ticks_to_arm", spec.contact.free_ticks_to_arm, kFreeTicks);
  contact.read("release_clearance_mm", spec.contact.release_clearance_mm, kClearanceMm);

  root.table("wall").read("position_mm", spec.wall_position_mm, kPositionMm);

  TomlTable target = root.table("target");
  target.read("stiffness_n_per_mm", spec.target_stiffness_n_per_mm, kStiffness);
  target.read("max_stiffness_n_per_mm", spec.max_target_stiffness_n_per_mm, kStiffness);
  target.read("ramp_s", spec.target_ramp_s, kRampS);

  TomlTable structure = root.table("structure");
  structure.read("compensation", spec.structural_compensation);
  structure.read("stiffness_n_per_mm", spec.structural_stiffness_n_per_mm, kStructural);

  TomlTable control = root.table("control");
  control.read("law", spec.controller.law, kLaws);
  control.read("proportional_gain", spec.controller.proportional_gain, kProportional);
  control.read("derivative_gain_ms", spec.controller.derivative_gain_ms, kDerivativeMs);

  TomlTable guard = root.table("guard");
  guard.read("max_force_n", spec.guard.max_force_n, kForceN);
  guard.read("max_force_rate_n_per_s", spec.guard.max_force_rate_n_per_s, kForceRate);
  guard.read("max_power_w", spec.guard.max_power_w, kPowerW);
  guard.read("sensor_stale_after_ms", spec.guard.sensor_stale_after_ms, kStaleMs);
  guard.read("resume_ramp_s", spec.guard.resume_ramp_s, kRampS);
  if (auto error = document->error()) return *error;

  const std::string where =
      root.has("name") ? fmt::format("{}, line {}", source, root.line_of("name")) : source;
  if (spec.name.empty() && !root.has("name")) {
    if (name.empty())
      return hal::Error{"the scene has no name", where, "", "", "add name = \"…\" at its top"};
    spec.name = name;
  }
  if (auto error = check_scene_name(spec.name, where)) return *error;
  if (!name.empty() && spec.name != name) {
    return hal::Error{"the scene's name is not that of its file", where, spec.name, name,
                      "rename the one or the other"};
  }
  return spec;
}

std::string write_scene(const rt::SceneSpec& spec) {
  const auto number = [](double value) { return toml_number(value); };
  std::string text;
  text +=
      fmt::format("name = {}\nkind = {}\ndescription = {}\nobject_model = {}\npress_axis = [{}, {}, {}]\n",
                  toml_quoted(spec.name), word_for(spec.kind, kKinds), toml_quoted(spec.description),
                  toml_quoted(spec.object_model), number(spec.press_axis.x), number(spec.press_axis.y),
                  number(spec.press_axis.z));
  text += fmt::format("\n[tool]\ntip = {}\nmass_g = {}\n", toml_quoted(spec.tip), number(spec.tool_mass_g));
  text += fmt::format(
      "\n[contact]\nmethod = {}\nthreshold_n = {}\nrelease_ratio = {}\nrelease_ticks = {}\n"
      "release_clearance_mm = {}\nquiet_ticks_after_release = {}\nfree_ticks_to_arm = {}\n",
      word_for(spec.contact.method, kMethods), number(spec.contact.threshold_n),
      number(spec.contact.release_ratio), spec.contact.release_ticks,
      number(spec.contact.release_clearance_mm), spec.contact.quiet_ticks_after_release,
      spec.contact.free_ticks_to_arm);
  text += fmt::format("\n[wall]\nposition_mm = {}\n", number(spec.wall_position_mm));
  text += fmt::format("\n[target]\nstiffness_n_per_mm = {}\nmax_stiffness_n_per_mm = {}\nramp_s = {}\n",
                      number(spec.target_stiffness_n_per_mm), number(spec.max_target_stiffness_n_per_mm),
                      number(spec.target_ramp_s));
  text += fmt::format("\n[structure]\ncompensation = {}\nstiffness_n_per_mm = {}\n",
                      spec.structural_compensation, number(spec.structural_stiffness_n_per_mm));
  text += fmt::format("\n[control]\nlaw = {}\nproportional_gain = {}\nderivative_gain_ms = {}\n",
                      word_for(spec.controller.law, kLaws), number(spec.controller.proportional_gain),
                      number(spec.controller.derivative_gain_ms));
  text += fmt::format(
      "\n[guard]\nmax_force_n = {}\nmax_force_rate_n_per_s = {}\nmax_power_w = {}\nsensor_stale_after_ms = "
      "{}\n"
      "resume_ramp_s = {}\n",
      number(spec.guard.max_force_n), number(spec.guard.max_force_rate_n_per_s),
      number(spec.guard.max_power_w), number(spec.guard.sensor_stale_after_ms),
      number(spec.guard.resume_ramp_s));
  return text;
}

}  // namespace hapticd::server
