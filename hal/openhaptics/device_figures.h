#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/rig.h"

namespace hapticd::openhaptics {

/// Data sheet of a model, used without asking the device.
struct DeviceFigures {
  hal::DeviceInfo info;
  bool supported_on_linux = true;  ///< by the vendor's library
};

std::optional<DeviceFigures> device_figures(const std::string& model);
std::vector<std::string> device_models();

/// Whether the device's own model name is a High Force model, which the vendor's Linux library does not
/// support.
bool names_high_force(const std::string& model_type);

}  // namespace hapticd::openhaptics
