#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::sim {

/// Family of laws that the simulated objects follow. Shapes, elastic curves and stiffness are the same.
enum class Plant : std::uint8_t {
  kSeparable,  ///< relaxation in three exponentials, the same at every depth; friction like Dahl's
  kGeneral,    ///< power-law relaxation, depth- and rate-dependent, with hysteresis; Maxwell-slip friction
};

std::optional<Plant> plant_named(const std::string& name);
const char* name_of(Plant plant) noexcept;
std::vector<std::string> plant_names();

}  // namespace hapticd::sim
