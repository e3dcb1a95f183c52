#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "tests/study/report/child_process.h"

namespace hapticd::bench {

/// Lateness of wake-ups.
struct WakeupQuantiles {
  double median_us = 0.0;
  double p99_us = 0.0;
  double p999_us = 0.0;
  double max_us = 0.0;
};

/// Reads what `cyclictest -h` prints: the histogram in whole microseconds, its overflows and its maximum.
/// None where there is no histogram.
std::optional<WakeupQuantiles> parse_cyclictest(std::string_view output);

/// The yardstick: one thread of cyclictest at the loop's rate and priority, running beside it.
class Cyclictest {
 public:
  Cyclictest(double seconds, std::filesystem::path output);

  struct Outcome {
    std::optional<WakeupQuantiles> wakeup;
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
