#include "hal/sim/base/plant.h"

namespace hapticd::sim {

std::optional<Plant> plant_named(const std::string& name) {
  for (const Plant plant : {Plant::kSeparable, Plant::kGeneral}) {
    if (name == name_of(plant)) return plant;
  }
  return std::nullopt;
}

const char* name_of(Plant plant) noexcept {
  return plant == Plant::kGeneral ? "general" : "separable";
}

std::vector<std::string> plant_names() {
  return {name_of(Plant::kSeparable), name_of(Plant::kGeneral)};
}

}  // namespace hapticd::sim
