#pragma once

#include <vector>

namespace hapticd::sim {

/// One tick of a clock that is not perfect.
struct TickInterval {
  double interval_us = 1000.0;  ///< since the tick before
  double sensor_late_us =
      0.0;  ///< the newest sensor sample that has arrived is so much older than the sensor's newest
  bool sensor_lost = false;  ///< what the sensor measured in this interval never arrives
};

/// Intervals between ticks, in order; over and over. At least one.
using TickIntervals = std::vector<TickInterval>;

}  // namespace hapticd::sim
