#pragma once

#include "hal/samples.h"

namespace hapticd::pose {

/// Relation of the coordinates of a device's own software to the rig's: p_device = R⁻¹ p_rig + origin_mm. By
/// default they are the rig's.
struct DeviceFrame {
  hal::Quaternion to_rig;  ///< R, from the device's axes to the rig's
  hal::Vector3 origin_mm;  ///< the rig's origin in the device's coordinates
};

/// OpenHaptics: x to the right, y up, z towards the user; a quarter turn about x from the rig's.
inline DeviceFrame openhaptics_frame(const hal::Vector3& origin_mm) noexcept {
  constexpr double kHalfRoot = 0.70710678118654752;
  return {{kHalfRoot, kHalfRoot, 0.0, 0.0}, origin_mm};
}

}  // namespace hapticd::pose
