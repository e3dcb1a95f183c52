#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/friction.h"
#include "hal/sim/material.h"
#include "hal/sim/shape.h"

namespace hapticd::sim {

/// A real object as the simulated rig knows it. Sources are named in object_model.cpp.
struct ObjectModel {
  std::string name;
  Shape shape;
  MaterialParameters material;
  FrictionParameters friction;  ///< with a solid aluminium rod of 3 mm
};

std::optional<ObjectModel> object_preset(const std::string& name);
std::vector<std::string> object_preset_names();

}  // namespace hapticd::sim
