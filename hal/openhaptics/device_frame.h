#pragma once

#include <array>
#include <optional>

#include "hal/samples.h"

namespace hapticd::openhaptics {

/// Turns the vendor's vector into the rig's. The vendor's frame has x to the right, y up and z towards the
/// user; the rig's has z up and y away from the user. Both are right-handed:
///   x = x_hd,  y = -z_hd,  z = y_hd
/// which is a rotation: forces, velocities and positions turn alike, and f·v is preserved.
constexpr hal::Vector3 rig_from_device(const hal::Vector3& v) noexcept {
  return {v.x, -v.z, v.y};
}
constexpr hal::Vector3 device_from_rig(const hal::Vector3& v) noexcept {
  return {v.x, v.z, -v.y};
}

/// The vendor's 4×4 transform, column by column.
using Transform = std::array<double, 16>;

/// Orientation of the tool in the rig frame, from a transform that may be slightly scaled or skewed. The
/// tool's axes are the vendor's: z along the stylus, from its tip to its end, so that a stylus held upright
/// has a z that points up. Nothing if the transform is not a rotation: not finite, mirrored, or with axes
/// shorter than 0.5, longer than 2 or skewed by more than 30°.
std::optional<hal::Quaternion> orientation_in_rig(const Transform& transform) noexcept;

}  // namespace hapticd::openhaptics
