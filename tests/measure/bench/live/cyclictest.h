#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tests/measure/bench/live/latency_distribution.h"
#include "tests/measure/report/child_process.h"

namespace hapticd::bench {

/// Reads what `cyclictest -h` prints: the histogram in whole microseconds and its overflows, which are
/// counted at the maximum. None if there is no histogram.
std::optional<LatencyDistribution> parse_cyclictest(std::string_view output);

/// Place in which a cyclictest runs.
struct CyclictestPlace {
  int priority = 80;  ///< SCHED_FIFO
  int cpu = -1;       ///< the only CPU it may run on; -1 = any
  int after_us = -1;  ///< it wakes so long after each full period of CLOCK_MONOTONIC; -1 = whenever it began
};

/// The yardstick: one thread of cyclictest at the loop's rate, running next to it.
class Cyclictest {
 public:
  Cyclictest(double seconds, std::filesystem::path output, const CyclictestPlace& place = {});

  struct Outcome {
    std::optional<LatencyDistribution> wakeup;
    std::string failed;  ///< why there is none, with the remedy
  };
  /// Waits for its end.
  Outcome finish();

 private:
  std::filesystem::path output_;
  std::chrono::seconds duration_;
  std::unique_ptr<report::ChildProcess> process_;
  std::string failed_;
};

}  // namespace hapticd::bench
