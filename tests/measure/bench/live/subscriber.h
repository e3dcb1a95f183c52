#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/measure/report/child_process.h"

namespace hapticd::bench {

/// What one subscriber received, or did not.
struct SubscriberTally {
  std::uint64_t samples = 0;
  std::uint64_t gaps = 0;                   ///< places where the sequence of ticks is broken
  std::uint64_t missing = 0;                ///< ticks missing there
  std::uint64_t disordered = 0;             ///< ticks repeated or out of order
  std::uint64_t dropped_by_subscriber = 0;  ///< as given in the stream
  std::uint64_t dropped_by_server = 0;
  std::uint64_t bytes = 0;  ///< of messages
  double behind_ms = 0.0;   ///< at the end, the newest sample behind the loop; of the slowest

  /// Nothing is missing, the one who lost it.
  bool complete() const noexcept {
    return gaps + disordered + dropped_by_subscriber + dropped_by_server == 0;
  }
  SubscriberTally& operator+=(const SubscriberTally& other) noexcept;
};

/// Subscribers at the full rate, all groups, each with its own connection, in a separate process as in real
/// life.
class SubscriberProcess {
 public:
  /// `result` is the file it leaves its tally in. `blocks`: by TELEMETRY_ENCODING_BLOCK.
  SubscriberProcess(const std::string& address, double seconds, std::filesystem::path result, int streams = 1,
                    bool blocks = false);

  /// Waits for its end; throws std::runtime_error if it ended badly or left no tally.
  SubscriberTally finish();
  pid_t pid() const noexcept { return process_.pid(); }

 private:
  std::filesystem::path result_;
  std::chrono::milliseconds timeout_;
  report::ChildProcess process_;
};

}  // namespace hapticd::bench
