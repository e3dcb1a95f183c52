#pragma once

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// Wake-up, computation and device time of the live loop under each load, next to cyclictest in the same
/// seconds. The loads take turns, round by round, so that whatever else the machine does meets all of them.
void measure_loop_under_load(report::Report& report, const RealtimeOptions& options);

}  // namespace hapticd::bench
