#pragma once

#include <string_view>

#include "rt/control/force_controller.h"

namespace hapticd::rt {

/// Gains the dissertation tuned for a device (D§3.3.2: 0.4-0.5 and 0.01-0.02 for the PHANToM 1.0, 1.0-1.1 and
/// 0.02-0.03 for the 1.5 high force, whichever driver moves it); the gentler pair for a device it does not
/// know.
constexpr ControllerParameters default_gains(std::string_view device_model) noexcept {
  if (device_model.ends_with("1_5_high_force")) return {ControlLaw::kClosedLoop, 1.05, 0.025};
  return {ControlLaw::kClosedLoop, 0.45, 0.015};
}

}  // namespace hapticd::rt
