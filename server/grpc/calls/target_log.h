#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>

namespace hapticd::server {

/// Who set which target, in the log: each time another client does, and else once a second at most, with how
/// many there were in between. Targets may come a hundred times a second.
class TargetLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// What to write now; empty: nothing. `target`: in words. Any thread.
  std::string line(const std::string& target, const std::string& peer, Clock::time_point now);

 private:
  std::mutex mutex_;
  std::string last_peer_;
  Clock::time_point next_{};
  std::uint64_t unwritten_ = 0;
};

}  // namespace hapticd::server
