#include "tests/measure/study/common/plant.h"

#include <utility>

namespace hapticd::study {

namespace {
sim::Plant current = sim::Plant::kSeparable;
}

sim::Plant current_plant() noexcept {
  return current;
}

void set_current_plant(sim::Plant plant) noexcept {
  current = plant;
}

hal::Result<std::unique_ptr<sim::SimulatedRig>> create_rig(sim::SimulationConfig config) {
  config.plant = sim::name_of(current);
  return sim::SimulatedRig::create(std::move(config));
}

void add_stage(report::Report& report, report::WorkPrecision stage) {
  if (current != sim::Plant::kSeparable && stage.justification.empty()) {
    stage.justification = "it was chosen on the separable family; on this one another does better.";
  }
  report::add_work_precision(report, stage);
}

std::string plant_suffix(sim::Plant plant) {
  return plant == sim::Plant::kSeparable ? "" : std::string("_") + sim::name_of(plant);
}

}  // namespace hapticd::study
