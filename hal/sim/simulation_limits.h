#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/sim/simulated_rig.h"

namespace hapticd::sim {

inline double length(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}
/// Checks what a hand can do.
std::optional<hal::Error> check(const HandProgram& program);
/// Device of a configuration: a preset or its own, with what is changed of it.
hal::Result<DeviceModel> device_of(const SimulationConfig& config);
/// Checks what a configuration says of structure and sensor beyond the preset.
std::optional<hal::Error> check_structure_and_sensor(const SimulationConfig& config);
/// Checks for what would divide by zero, or hang. The presets need no check.
std::optional<hal::Error> check_custom(const SimulationConfig& config);

}  // namespace hapticd::sim
