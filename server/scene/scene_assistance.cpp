#include "server/scene/scene_assistance.h"

#include "server/text/toml_writer.h"

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
constexpr Range kContactS{0.0, 100.0, "s"};
constexpr Range kContacts{0.0, 1000.0, ""};

void assistance_fields(auto& root, auto& spec) {
  root.table("fixture", spec.fixture, [](auto& table, auto& fixture) {
    table.field("stiffness_n_per_mm", fixture.stiffness_n_per_mm, kFixtureStiffness);
    table.field("damping_n_s_per_mm", fixture.damping_n_s_per_mm, kFixtureDamping);
    table.field("max_force_n", fixture.max_force_n, kFixtureForceN);
    table.field("ceiling_mm", fixture.ceiling_mm, kCeilingMm);
    table.field("corridor_mm", fixture.corridor_mm, kCorridorMm);
    table.field("let_go_mm", fixture.let_go_mm, kLetGoMm);
  });
  root.table("watch", spec.watch, [](auto& table, auto& watch) {
    table.field("max_press_speed_mm_per_s", watch.max_press_speed_mm_per_s, kSpeedMmPerS);
    table.field("max_lateral_mm", watch.max_lateral_mm, kLateralMm);
    table.field("max_contact_speed_mm_per_s", watch.max_contact_speed_mm_per_s, kSpeedMmPerS);
    table.field("max_contacts", watch.max_contacts, kContacts);
    table.field("min_lateral_path_mm", watch.min_lateral_path_mm, kPathMm);
    table.field("min_contact_s", watch.min_contact_s, kContactS);
  });
}

}  // namespace

void read_assistance(TomlTable& root, rt::SceneSpec& spec) {
  assistance_fields(root, spec);
}

std::string assistance_text(const rt::SceneSpec& spec) {
  return toml_fields([&](auto& root) { assistance_fields(root, spec); });
}

}  // namespace hapticd::server
