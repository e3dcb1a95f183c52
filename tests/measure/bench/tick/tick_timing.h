#pragma once

#include "tests/measure/bench/tick/tick_workload.h"

namespace hapticd::bench {

/// Nanoseconds per tick. Medians are over batches of 32 ticks, which no clock reading disturbs; the 99.9th
/// percentile is over ticks timed one by one, less the cost of reading the clock.
struct TickTimes {
  double median_ns = 0.0;
  double free_median_ns = 0.0;     ///< of batches out of contact; NaN if there are none
  double contact_median_ns = 0.0;  ///< of batches in contact; NaN if there are none
  double p999_ns = 0.0;
  double clock_ns = 0.0;  ///< what was subtracted
};

/// Spends about `seconds`.
TickTimes time_ticks(TickWorkload& workload, double seconds);

}  // namespace hapticd::bench
