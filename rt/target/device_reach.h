#pragma once

#include <algorithm>
#include <limits>

#include "hal/rig.h"

namespace hapticd::rt {

/// Largest device forces, both ≥ 0, in N.
struct DeviceReach {
  double pull_n = 0.0;  ///< into the object, for softer: no more than the sensor bears
  double push_n = 0.0;  ///< against the hand, for harder
};

/// Share of the sensor's range that the device may use up by pressing the tool into an object. The sensor at
/// the tip feels hand and device together, f_r = f_h + f_d (3.1): the rest is left to the hand, to knocks and
/// to the tool's inertia. Of the 35 N of D§3.1 a device pulls with 24.5 N and leaves 10.5 N.
inline constexpr double kMaxPullOfSensor = 0.7;

/// Force, in N, that the sensor's range allows a device to pull with: infinite if the range is not known or
/// no force reaches a device. `range_n` is the sensor's along the tool; across it has less (25 of 35 N).
constexpr double pull_within_sensor_n(double range_n) noexcept {
  return range_n > 0.0 ? kMaxPullOfSensor * range_n : std::numeric_limits<double>::infinity();
}

/// Pull within the sensor's range on a rig. A recording takes the largest force in it for the range, and
/// pulls at nothing.
inline double pull_within_sensor_n(const hal::RigInfo& rig) noexcept {
  return pull_within_sensor_n(rig.renders_force ? rig.sensor.range_n : 0.0);
}

/// Reach of a device that gives up to `max_force_n` on this rig.
inline DeviceReach device_reach(double max_force_n, const hal::RigInfo& rig) noexcept {
  return {std::min(max_force_n, pull_within_sensor_n(rig)), max_force_n};
}

}  // namespace hapticd::rt
