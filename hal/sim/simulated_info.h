#pragma once

#include "hal/rig.h"
#include "hal/sim/base/conditions.h"
#include "hal/sim/base/plant.h"
#include "hal/sim/device/device_model.h"
#include "hal/sim/simulated_rig.h"

namespace hapticd::sim {

/// Information of a simulated rig about itself: by its parts' data sheets. The truth may differ.
hal::RigInfo info_of(const SimulationConfig& config, const DeviceModel& device, Plant plant,
                     const Conditions& conditions, const hal::SensorInfo& sensor);

}  // namespace hapticd::sim
