#pragma once

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// How many subscribers get every tick, all groups, on this machine, readers included, until the first loss;
/// bytes and processor time of each.
void measure_fan_out(report::Report& report, const RealtimeOptions& options);

}  // namespace hapticd::bench
