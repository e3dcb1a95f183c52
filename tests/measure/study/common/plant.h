#pragma once

#include <memory>
#include <string>

#include "hal/error.h"
#include "hal/sim/base/plant.h"
#include "hal/sim/simulated_rig.h"
#include "tests/measure/report/work_precision.h"

namespace hapticd::study {

/// The family of objects that the part under way is measured on. Changed between parts only; parts read it
/// from any thread.
sim::Plant current_plant() noexcept;
void set_current_plant(sim::Plant plant) noexcept;

/// Measures on a family while it lives.
class OnPlant {
 public:
  explicit OnPlant(sim::Plant plant) : before_(current_plant()) { set_current_plant(plant); }
  ~OnPlant() { set_current_plant(before_); }
  OnPlant(const OnPlant&) = delete;
  OnPlant& operator=(const OnPlant&) = delete;

 private:
  sim::Plant before_;
};

/// A simulated rig with objects of that family; every study makes its rigs here.
hal::Result<std::unique_ptr<sim::SimulatedRig>> create_rig(sim::SimulationConfig config);

/// report::add_work_precision(). Defaults were chosen on the separable family: if one is beaten on the other,
/// that is a finding, and the sentence on it says so.
void add_stage(report::Report& report, report::WorkPrecision stage);

/// Suffix of a file's name, so that both families' files can be in one folder: "" or "_general".
std::string plant_suffix(sim::Plant plant);

}  // namespace hapticd::study
