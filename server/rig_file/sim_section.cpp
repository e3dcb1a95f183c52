#include "server/rig_file/sim_section.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "server/text/toml_writer.h"

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

template <class Table>
void simulation_fields(Table& table, auto& config) {
  table.field("device", config.device, 64);
  table.field("object", config.object, 64);
  table.field("tip", config.tip, 64);
  table.field("plant", config.plant, 64);
  table.field("seed", config.seed, kSeed);
  double speed = config.real_time ? 1.0 : config.speed;
  table.field("speed", speed, kSpeed);
  if constexpr (Table::kReads) {
    config.real_time = speed == 1.0;
    config.speed = config.real_time ? 0.0 : speed;
  }
  table.field("tool_mass_g", config.tool_mass_g, kToolMassG);
  table.field("structural_mode_hz", config.structural_mode_hz, kStructuralModeHz);
  table.field("structural_damping", config.structural_damping, kStructuralDamping);
  table.field("amplifier_pole_hz", config.amplifier_pole_hz, kAmplifierPoleHz);
  table.field("object_edge_mm", config.hold.edge_mm, kEdgeMm);
  table.field("object_slides_above_n", config.hold.slides_above_n, kSlidesAboveN);
}

}  // namespace

void read_simulation(TomlTable table, sim::SimulationConfig& config) {
  simulation_fields(table, config);

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
  std::string text;
  TomlWriter table = TomlWriter(text, "rig").table("sim");
  simulation_fields(table, config);
  TomlWriter conditions = table.table("conditions");
  conditions.field("preset", config.conditions);
  for (const auto& [name, value] : config.condition_values) conditions.field(name, value);
  return text;
}

}  // namespace hapticd::server
