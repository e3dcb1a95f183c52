#pragma once

#include <string>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/report/report.h"

namespace hapticd::bench {

/// Measures from the call that sets a target to its answer, which comes after the tick it took effect at,
/// next to the same call to a server that answers at once.
void measure_command_latency(report::Report& report, const RealtimeOptions& options);

/// Runs that server: answers SetTarget with an answer of the usual size, until it is asked to end.
int run_echo_child();

}  // namespace hapticd::bench
