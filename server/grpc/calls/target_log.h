#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "hal/lock/mutex.h"

namespace hapticd::server {

/// Log lines of targets: one whenever another client sets a target, otherwise at most one a second, with the
/// count of those in between. Targets may come a hundred times a second.
class TargetLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// Line to write now; empty: none. `target`: as text. Any thread.
  std::string line(const std::string& target, const std::string& peer, Clock::time_point now);

 private:
  Mutex mutex_;
  std::string last_peer_ GUARDED_BY(mutex_);
  Clock::time_point next_ GUARDED_BY(mutex_){};
  std::uint64_t unwritten_ GUARDED_BY(mutex_) = 0;
};

}  // namespace hapticd::server
