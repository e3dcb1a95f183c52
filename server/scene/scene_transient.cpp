#include "server/scene/scene_transient.h"

#include <cstdint>

#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kModeHz{10.0, 300.0, "Hz"};
constexpr Range kDecayPerS{30.0, 1000.0, "1/s"};
constexpr Range kGainPerS{0.0, 1000.0, "1/s"};
constexpr Range kTransientForceN{0.01, 20.0, "N"};
constexpr Range kStructuralHz{10.0, 2000.0, "Hz"};
constexpr Range kAmplifierHz{50.0, 1e5, "Hz"};
constexpr Range kGripMassG{1.0, 1000.0, "g"};
constexpr Range kGripStiffness{0.0, 100.0, "N/mm"};
constexpr Range kGripDamping{0.0, 1.0, "N·s/mm"};

enum class Material : std::uint8_t { kOwn, kRubber, kWood, kMetal };
constexpr Word<Material> kMaterials[] = {
    {"rubber", Material::kRubber}, {"wood", Material::kWood}, {"metal", Material::kMetal}};

/// Frequency and decay: Okamura et al. 2001. Gains assumed.
rt::TransientMode mode_of(Material material) {
  switch (material) {
    case Material::kRubber:
      return {18.0, 60.0, 5.0};
    case Material::kMetal:
      return {300.0, 90.0, 15.0};
    default:
      return {100.0, 80.0, 15.0};
  }
}

/// All keys but the material.
void transient_fields(auto& table, auto& transient) {
  table.field("max_force_n", transient.max_force_n, kTransientForceN);
  auto& grip = transient.grip;
  table.field("mode_hz", grip.mode_hz, kStructuralHz);
  table.field("amplifier_hz", grip.amplifier_hz, kAmplifierHz);
  table.field("grip_mass_g", grip.grip_mass_g, kGripMassG);
  table.field("grip_stiffness_n_per_mm", grip.grip_stiffness_n_per_mm, kGripStiffness);
  table.field("grip_damping_n_s_per_mm", grip.grip_damping_n_s_per_mm, kGripDamping);
  table.field("object_stiffness_n_per_mm", grip.object_stiffness_n_per_mm, kGripStiffness);
  const auto mode_fields = [](auto& one, auto& mode) {
    one.field("frequency_hz", mode.frequency_hz, kModeHz);
    one.field("decay_per_s", mode.decay_per_s, kDecayPerS);
    one.field("gain_per_s", mode.gain_per_s, kGainPerS);
  };
  table.tables("mode", transient.target, rt::TransientParameters::kMaxModes, mode_fields);
  table.tables("real", transient.real, rt::TransientParameters::kMaxModes, mode_fields);
}

}  // namespace

void read_transient(TomlTable& root, rt::SceneSpec& spec) {
  root.table("transient", spec.transient, [](TomlTable& table, rt::TransientParameters& transient) {
    Material material = Material::kOwn;
    table.read("material", material, kMaterials);
    transient_fields(table, transient);
    if (material == Material::kOwn) return;
    table.refuse("mode", hal::Error::of(hal::ErrorCode::kContradiction,
                                        "a transient has a material or modes of its own", "", "",
                                        "material or [[transient.mode]]", "remove one of them"));
    transient.target = {mode_of(material)};
  });
}

std::string transient_text(const rt::SceneSpec& spec) {
  return toml_fields([&](TomlWriter& root) {
    root.table("transient", spec.transient,
               [](TomlWriter& table, const auto& transient) { transient_fields(table, transient); });
  });
}

}  // namespace hapticd::server
