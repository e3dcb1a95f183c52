#pragma once

#include <string>
#include <vector>

#include "hal/rig.h"
#include "hal/sim/base/plant.h"
#include "hal/sim/object/general_material.h"

namespace hapticd::sim {

/// Parameters that the general family adds to the preset of this name.
GeneralMaterialParameters general_material_of(const std::string& object);

/// Assumptions of a family, for the rig's information.
std::vector<hal::UncertainParameter> uncertain_of(Plant plant);

}  // namespace hapticd::sim
