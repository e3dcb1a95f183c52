#include "server/rig_file/sim_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "server/text/range.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kSeed{0.0, 9007199254740992.0, ""};
constexpr Range kStructuralModeHz{10.0, 1000.0, "Hz"};
constexpr Range kStructuralDamping{0.0, 2.0, ""};
constexpr Range kAmplifierPoleHz{10.0, 5000.0, "Hz"};
constexpr Range kToolMassG{0.0, 500.0, "g"};
constexpr Range kEdgeMm{-200.0, 200.0, "mm"};
constexpr Range kSpeed{0.1, 100.0, ""};
constexpr Range kSlidesAboveN{0.0, 100.0, "N"};

constexpr Word<int> kConditionWords[] = {{"clean", 0}, {"lab", 1}, {"arm", 2}};

}  // namespace

void read_simulation(TomlTable table, sim::SimulationConfig& config) {
  table.read("device", config.device, 64);
  table.read("object", config.object, 64);
  table.read("tip", config.tip, 64);
  table.read("plant", config.plant, 64);
  table.read("seed", config.seed, kSeed);
  double speed = config.real_time ? 1.0 : config.speed;
  table.read("speed", speed, kSpeed);
  config.real_time = speed == 1.0;
  config.speed = config.real_time ? 0.0 : speed;
  table.read("structural_mode_hz", config.structural_mode_hz, kStructuralModeHz);
  table.read("structural_damping", config.structural_damping, kStructuralDamping);
  table.read("amplifier_pole_hz", config.amplifier_pole_hz, kAmplifierPoleHz);
  table.read("tool_mass_g", config.tool_mass_g, kToolMassG);
  table.read("object_edge_mm", config.hold.edge_mm, kEdgeMm);
  table.read("object_slides_above_n", config.hold.slides_above_n, kSlidesAboveN);

  TomlTable conditions = table.table("conditions");
  int preset = 0;
  for (const Word<int>& word : kConditionWords) {
    if (config.conditions == word.text) preset = word.value;
  }
  conditions.read("preset", preset, kConditionWords);
  config.conditions = kConditionWords[preset].text;
  for (const sim::ConditionField& field : sim::condition_fields()) {
    std::optional<double> value;
    conditions.read(field.name, value, Range{field.low, field.high, field.unit});
    if (value) config.condition_values[std::string(field.name)] = *value;
  }
}

void apply_simulation_text(std::string_view text, sim::SimulationConfig& config) {
  const auto is_one_of = [](const std::vector<std::string>& names, std::string_view word) {
    return std::find(names.begin(), names.end(), word) != names.end();
  };
  bool has_device = false;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(':'));
    text.remove_prefix(std::min(text.size(), word.size() + 1));
    if (is_one_of(sim::condition_preset_names(), word)) {
      config.conditions = word;
    } else if (is_one_of(sim::SimulatedRig::plants(), word)) {
      config.plant = word;
    } else if (!word.empty()) {
      (has_device ? config.conditions : config.device) = word;
      has_device = true;
    }
  }
}

std::string write_simulation(const sim::SimulationConfig& config) {
  std::string text = fmt::format(
      "\n[rig.sim]\ndevice = {}\nobject = {}\ntip = {}\nplant = {}\nseed = {}\nspeed = {}\ntool_mass_g = "
      "{}\n",
      toml_quoted(config.device), toml_quoted(config.object), toml_quoted(config.tip),
      toml_quoted(config.plant), config.seed, toml_number(config.real_time ? 1.0 : config.speed),
      toml_number(config.tool_mass_g));
  const auto optional = [&text](std::string_view key, const std::optional<double>& value) {
    if (value) text += fmt::format("{} = {}\n", key, toml_number(*value));
  };
  optional("structural_mode_hz", config.structural_mode_hz);
  optional("structural_damping", config.structural_damping);
  optional("amplifier_pole_hz", config.amplifier_pole_hz);
  optional("object_edge_mm", config.hold.edge_mm);
  text += fmt::format("object_slides_above_n = {}\n\n[rig.sim.conditions]\npreset = {}\n",
                      toml_number(config.hold.slides_above_n), toml_quoted(config.conditions));
  for (const auto& [name, value] : config.condition_values) {
    text += fmt::format("{} = {}\n", name, toml_number(value));
  }
  return text;
}

}  // namespace hapticd::server
