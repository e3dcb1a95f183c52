#pragma once

#include <string>
#include <string_view>

#include "hal/sim/simulated_rig.h"
#include "server/text/toml_reader.h"

namespace hapticd::server {

/// Reads the keys of a simulated rig; see hal/sim/README.md. Absent keys change nothing.
void read_simulation(TomlTable table, sim::SimulationConfig& config);

/// "phantom_1_0", "lab", "phantom_1_0:lab:general" …, as written after "sim:": a device, conditions and a
/// plant, in any order. The first word that is neither conditions nor plant is the device. A second one
/// is taken for conditions; the rig refuses unknown ones.
void apply_simulation_text(std::string_view text, sim::SimulationConfig& config);

/// Writes all keys with every default, with the headers of the tables; reads back as the same.
std::string write_simulation(const sim::SimulationConfig& config);

}  // namespace hapticd::server
