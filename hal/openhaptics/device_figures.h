#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"

namespace hapticd::openhaptics {

/// What is known of a model without asking the device, from its data sheet.
struct DeviceFigures {
  hal::DeviceInfo info;
  bool supported_on_linux = true;  ///< by the vendor's library
};

std::optional<DeviceFigures> device_figures(const std::string& model);
std::vector<std::string> device_models();

/// Whether a device that calls itself so is one of the High Force models, which the vendor's Linux library
/// does not support.
bool names_high_force(const std::string& model_type);

}  // namespace hapticd::openhaptics
