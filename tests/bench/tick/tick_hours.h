#pragma once

#include "tests/bench/tick/tick_workload.h"

namespace hapticd::bench {

/// How long ticks take while a tool lies still for hours after a contact: every filter decays towards zero,
/// and to denormal numbers where they are not flushed.
struct RestingTimes {
  double first_ns = 0.0;    ///< median of the medians of the first five minutes
  double last_ns = 0.0;     ///< and of the last thirty
  double slowest_ns = 0.0;  ///< the largest of all minutes' medians; whatever else the machine did is in it
};

/// `hours` of the rig's time at 1 kHz, as fast as they go. With `flushed`, as the loop's thread computes.
RestingTimes time_rest(TickWorkload& workload, double hours, bool flushed);

}  // namespace hapticd::bench
