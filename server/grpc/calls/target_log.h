#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace hapticd::server {

/// Log lines of targets: one whenever another client sets a target, otherwise at most one a second, with the
/// count of those in between. Targets may come a hundred times a second.
class TargetLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// The line to write now; empty: none. `target`: as text. Any thread.
  std::string line(const std::string& target, const std::string& peer, Clock::time_point now);

 private:
  std::mutex mutex_;
  std::string last_peer_;
  Clock::time_point next_{};
  std::uint64_t unwritten_ = 0;
};

}  // namespace hapticd::server
