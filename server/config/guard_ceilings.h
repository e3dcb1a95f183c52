#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/scene/scene_spec.h"

namespace hapticd::server {

/// [guard] of the daemon's configuration: the hardest limits any scene or target may ask for, so that no
/// client can lift them. The defaults are what the shipped scenes use, with a little room; a person who may
/// edit the daemon's configuration may choose others.
struct GuardCeilings {
  double max_force_n = 0.0;             ///< 0 = the device's own
  double max_force_rate_n_per_s = 0.0;  ///< 0 = the device's force in 5 ms, as in scenes that do not set it
  double max_power_w = 2.5;
  double max_target_stiffness_n_per_mm = 0.0;  ///< 0 = rt::largest_target_n_per_mm()
  double max_wall_stiffness_n_per_mm = 0.0;    ///< 0 = rt::default_largest_wall_n_per_mm() of the device
  double min_target_ramp_s = 0.1;              ///< for any change of the target
  /// How fast a change of the target may change the force.
  double max_target_change_n_per_s = 10.0;
  double min_resume_ramp_s = 0.25;
  double max_fall_ramp_s = 0.2;
  double max_sensor_stale_after_ms = 5.0;  ///< of scenes with a force sensor; never 0: the check is never off
  double max_loop_gap_ms = 50.0;           ///< never 0: the check is never off
};

/// The ceilings on this device, every "the device's own" filled in.
GuardCeilings on_device(const GuardCeilings& ceilings, const hal::DeviceInfo& device);

/// Fills in, before a scene is resolved, what it leaves to the daemon (zeros, and SceneSpec's defaults)
/// within the ceilings; each value that differs from what the scene would have got without them is reported
/// in `remarks`.
void fill_from_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device, rt::SceneSpec& scene,
                        std::vector<std::string>& remarks);

/// Checks a resolved scene: an error if it asks for more than a ceiling or less than a floor, by the scene's
/// key, with the limit and the key of [guard].
std::optional<hal::Error> check_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device,
                                         const rt::SceneSpec& resolved);

/// Limits that no scene asked for: the daemon's own, reduced to the ceilings.
rt::GuardLimits within_ceilings(const GuardCeilings& ceilings, const hal::DeviceInfo& device,
                                rt::GuardLimits limits);

}  // namespace hapticd::server
