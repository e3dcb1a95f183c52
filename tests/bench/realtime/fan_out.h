#pragma once

#include "tests/bench/benchmark.h"
#include "tests/study/report/report.h"

namespace hapticd::bench {

/// How many subscribers get every tick, all groups, on this machine, readers included, until the first loss;
/// bytes and processor time of each.
void measure_fan_out(report::Report& report, const RealtimeOptions& options);

}  // namespace hapticd::bench
