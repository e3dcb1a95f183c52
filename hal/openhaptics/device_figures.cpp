#include "hal/openhaptics/device_figures.h"

#include <cctype>

namespace hapticd::openhaptics {

namespace {

// SensAble's and 3D Systems' data sheets; the back-drive friction of the Premium 1.0 is from the
// literature, not checked. If a sheet gives a figure for each axis (stiffness of the two desktop devices),
// the lowest is used.
const std::vector<DeviceFigures>& figures() {
  static const std::vector<DeviceFigures> all = {
      {{"phantom_premium_1_0", 8.5, 1.4, 0.03, 3.5, 75.0, 0.06}},
      {{"phantom_premium_1_5", 8.5, 1.4, 0.03, 3.5, 75.0, 0.04}},
      {{"phantom_premium_1_5_high_force", 37.5, 6.2, 0.007, 3.5, 150.0, 0.2}, false},
      {{"phantom_desktop", 7.9, 1.75, 0.023, 1.48, 45.0, 0.06}},
      {{"phantom_omni", 3.3, 0.88, 0.055, 1.02, 45.0, 0.26}},
  };
  return all;
}

}  // namespace

std::optional<DeviceFigures> device_figures(const std::string& model) {
  for (const DeviceFigures& device : figures()) {
    if (device.info.model == model) return device;
  }
  return std::nullopt;
}

std::vector<std::string> device_models() {
  std::vector<std::string> names;
  for (const DeviceFigures& device : figures()) names.push_back(device.info.model);
  return names;
}

bool names_high_force(const std::string& model_type) {
  std::string letters;
  for (const char c : model_type) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return letters.find("highforce") != std::string::npos || letters.ends_with("hf");
}

}  // namespace hapticd::openhaptics
