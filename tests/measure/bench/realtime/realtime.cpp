#include <algorithm>

#include "tests/measure/bench/benchmark.h"
#include "tests/measure/bench/realtime/command_latency.h"
#include "tests/measure/bench/realtime/fan_out.h"
#include "tests/measure/bench/realtime/loop_under_load.h"

namespace hapticd::bench {
namespace {

struct Part {
  const char* name;
  void (*measure)(report::Report&, const RealtimeOptions&);
};

// The loop last: it gives up a CPU of this process for good.
constexpr Part kParts[]{
    {"command", measure_command_latency}, {"fan_out", measure_fan_out}, {"loop", measure_loop_under_load}};

}  // namespace

std::vector<std::string> realtime_parts() {
  std::vector<std::string> names;
  for (const Part& part : kParts) names.emplace_back(part.name);
  return names;
}

int run_realtime(const RealtimeOptions& options) {
  report::Report report(options.folder);
  report.begin_section("report_realtime", "What the loop costs in real time, under load, next to cyclictest");
  for (const Part& part : kParts) {
    const bool wanted = options.only.empty() ||
                        std::find(options.only.begin(), options.only.end(), part.name) != options.only.end();
    if (wanted) part.measure(report, options);
  }
  return 0;
}

}  // namespace hapticd::bench
