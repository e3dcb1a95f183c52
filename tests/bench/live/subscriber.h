#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/study/report/child_process.h"

namespace hapticd::bench {

/// What one subscriber received, or did not.
struct SubscriberTally {
  std::uint64_t samples = 0;
  std::uint64_t gaps = 0;                   ///< places where the sequence of ticks is broken
  std::uint64_t missing = 0;                ///< ticks missing there
  std::uint64_t disordered = 0;             ///< ticks repeated or out of order
  std::uint64_t dropped_by_subscriber = 0;  ///< as told in the stream
  std::uint64_t dropped_by_server = 0;

  SubscriberTally& operator+=(const SubscriberTally& other) noexcept;
};

/// A subscriber at the full rate, all groups, in a process of its own as in real life: with its own
/// connection, and able to stall or die as a whole.
class SubscriberProcess {
 public:
  /// `result` is the file it leaves its tally in.
  SubscriberProcess(const std::string& address, double seconds, std::filesystem::path result);

  /// Stops the whole process, as a debugger or a frozen machine does.
  void stall() noexcept;
  void kill() noexcept;
  /// Waits for its end; throws std::runtime_error where it ended badly or left no tally.
  SubscriberTally finish();

 private:
  std::filesystem::path result_;
  std::chrono::milliseconds patience_;
  report::ChildProcess process_;
};

/// What the process runs: subscribes, reads for so many seconds, writes its tally to `result`.
int run_subscriber(const std::string& address, double seconds, const std::filesystem::path& result);

}  // namespace hapticd::bench
