#include "server/scene/scene_transient.h"

#include <fmt/format.h>

#include <cstdint>

#include "server/text/toml_text.h"

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

void read_modes(TomlTable& table, std::string_view key, std::vector<rt::TransientMode>& modes) {
  for (TomlTable& one : table.tables(key, rt::TransientParameters::kMaxModes)) {
    rt::TransientMode& mode = modes.emplace_back();
    one.read("frequency_hz", mode.frequency_hz, kModeHz);
    one.read("decay_per_s", mode.decay_per_s, kDecayPerS);
    one.read("gain_per_s", mode.gain_per_s, kGainPerS);
  }
}

std::string modes_text(std::string_view key, const std::vector<rt::TransientMode>& modes) {
  std::string text;
  for (const rt::TransientMode& mode : modes) {
    text += fmt::format("\n[[transient.{}]]\nfrequency_hz = {}\ndecay_per_s = {}\ngain_per_s = {}\n", key,
                        toml_number(mode.frequency_hz), toml_number(mode.decay_per_s),
                        toml_number(mode.gain_per_s));
  }
  return text;
}

}  // namespace

void read_transient(TomlTable& root, rt::SceneSpec& spec) {
  if (!root.has("transient")) return;
  rt::TransientParameters& transient = spec.transient.emplace();
  TomlTable table = root.table("transient");
  Material material = Material::kOwn;
  table.read("material", material, kMaterials);
  read_modes(table, "mode", transient.target);
  read_modes(table, "real", transient.real);
  if (material != Material::kOwn) {
    table.refuse("mode", hal::Error::of(hal::ErrorCode::kContradiction,
                                        "a transient has a material or modes of its own", "", "",
                                        "material or [[transient.mode]]", "remove one of them"));
    transient.target = {mode_of(material)};
  }
  table.read("max_force_n", transient.max_force_n, kTransientForceN);
  rt::GripDynamics& grip = transient.grip;
  table.read("mode_hz", grip.mode_hz, kStructuralHz);
  table.read("amplifier_hz", grip.amplifier_hz, kAmplifierHz);
  table.read("grip_mass_g", grip.grip_mass_g, kGripMassG);
  table.read("grip_stiffness_n_per_mm", grip.grip_stiffness_n_per_mm, kGripStiffness);
  table.read("grip_damping_n_s_per_mm", grip.grip_damping_n_s_per_mm, kGripDamping);
  table.read("object_stiffness_n_per_mm", grip.object_stiffness_n_per_mm, kGripStiffness);
}

std::string transient_text(const rt::SceneSpec& spec) {
  if (!spec.transient) return {};
  const rt::TransientParameters& t = *spec.transient;
  return fmt::format(
             "\n[transient]\nmax_force_n = {}\nmode_hz = {}\namplifier_hz = {}\n"
             "grip_mass_g = {}\ngrip_stiffness_n_per_mm = {}\ngrip_damping_n_s_per_mm = {}\n"
             "object_stiffness_n_per_mm = {}\n",
             toml_number(t.max_force_n), toml_number(t.grip.mode_hz), toml_number(t.grip.amplifier_hz),
             toml_number(t.grip.grip_mass_g), toml_number(t.grip.grip_stiffness_n_per_mm),
             toml_number(t.grip.grip_damping_n_s_per_mm), toml_number(t.grip.object_stiffness_n_per_mm)) +
         modes_text("mode", t.target) + modes_text("real", t.real);
}

}  // namespace hapticd::server
