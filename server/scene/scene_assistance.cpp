#include "server/scene/scene_assistance.h"

#include <fmt/format.h>

#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kFixtureStiffness{0.05, 1.0, "N/mm"};
constexpr Range kFixtureDamping{0.001, 0.005, "N·s/mm"};
constexpr Range kFixtureForceN{0.1, 4.0, "N"};
constexpr Range kCeilingMm{0.0, 20.0, "mm"};
constexpr Range kCorridorMm{0.0, 50.0, "mm"};
constexpr Range kLetGoMm{2.0, 50.0, "mm"};
constexpr Range kSpeedMmPerS{0.0, 2000.0, "mm/s"};
constexpr Range kLateralMm{0.0, 500.0, "mm"};
constexpr Range kPathMm{0.0, 10'000.0, "mm"};
constexpr Range kContacts{0.0, 1000.0, ""};

}  // namespace

void read_assistance(TomlTable& root, rt::SceneSpec& spec) {
  if (root.has("fixture")) {
    rt::FixtureParameters& fixture = spec.fixture.emplace();
    TomlTable table = root.table("fixture");
    table.read("stiffness_n_per_mm", fixture.stiffness_n_per_mm, kFixtureStiffness);
    table.read("damping_n_s_per_mm", fixture.damping_n_s_per_mm, kFixtureDamping);
    table.read("max_force_n", fixture.max_force_n, kFixtureForceN);
    table.read("ceiling_mm", fixture.ceiling_mm, kCeilingMm);
    table.read("corridor_mm", fixture.corridor_mm, kCorridorMm);
    table.read("let_go_mm", fixture.let_go_mm, kLetGoMm);
  }
  if (root.has("watch")) {
    rt::WatchLimits& watch = spec.watch.emplace();
    TomlTable table = root.table("watch");
    table.read("max_press_speed_mm_per_s", watch.max_press_speed_mm_per_s, kSpeedMmPerS);
    table.read("max_lateral_mm", watch.max_lateral_mm, kLateralMm);
    table.read("max_contact_speed_mm_per_s", watch.max_contact_speed_mm_per_s, kSpeedMmPerS);
    table.read("max_contacts", watch.max_contacts, kContacts);
    table.read("min_lateral_path_mm", watch.min_lateral_path_mm, kPathMm);
  }
}

std::string assistance_text(const rt::SceneSpec& spec) {
  std::string text;
  if (spec.fixture) {
    const rt::FixtureParameters& f = *spec.fixture;
    text += fmt::format(
        "\n[fixture]\nstiffness_n_per_mm = {}\ndamping_n_s_per_mm = {}\nmax_force_n = {}\nceiling_mm = {}\n"
        "corridor_mm = {}\nlet_go_mm = {}\n",
        toml_number(f.stiffness_n_per_mm), toml_number(f.damping_n_s_per_mm), toml_number(f.max_force_n),
        toml_number(f.ceiling_mm), toml_number(f.corridor_mm), toml_number(f.let_go_mm));
  }
  if (spec.watch) {
    const rt::WatchLimits& w = *spec.watch;
    text += fmt::format(
        "\n[watch]\nmax_press_speed_mm_per_s = {}\nmax_lateral_mm = {}\nmax_contact_speed_mm_per_s = {}\n"
        "max_contacts = {}\nmin_lateral_path_mm = {}\n",
        toml_number(w.max_press_speed_mm_per_s), toml_number(w.max_lateral_mm),
        toml_number(w.max_contact_speed_mm_per_s), w.max_contacts, toml_number(w.min_lateral_path_mm));
  }
  return text;
}

}  // namespace hapticd::server
