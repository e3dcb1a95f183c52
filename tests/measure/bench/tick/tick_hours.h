#pragma once

#include <string>

#include "hal/error.h"

namespace hapticd::bench {

/// How long ticks take while a tool lies still for hours after a contact, as multiples of those of a tool
/// that was laid down seconds ago: every filter decays towards zero, and to denormal numbers if they are not
/// flushed. The three take turns every 60 ticks, so that a machine that changes its speed changes all alike.
struct RestingTimes {
  double fresh_ns = 0.0;         ///< laid down seconds ago, flushed; median
  double flushed_ratio = 0.0;    ///< at rest for hours, over fresh; median of the last thirty minutes
  double flushed_slowest = 0.0;  ///< the same, largest of all minutes; what else the machine did is in it
  double kept_ratio = 0.0;       ///< as flushed_ratio, if denormal numbers are not flushed
  double kept_slowest = 0.0;
};

/// `hours` (above 0) of the rig's time at 1 kHz, as fast as they go. Fails for a scene that is not one of
/// tick_scenes().
hal::Result<RestingTimes> time_rest(const std::string& scene, double hours);

}  // namespace hapticd::bench
