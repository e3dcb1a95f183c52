#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd::server {

class Session;

/// Says that the service is alive only while its loop makes progress: a loop that hangs starves the watchdog
/// of the service, although all other threads run.
class LoopWatchdog {
 public:
  /// A number that changes while the loop is well.
  using Progress = Callback<std::uint64_t()>;
  using Feed = Callback<void()>;

  /// Looks four times within `timeout`, and calls `feed` each time `progress` has changed since the last
  /// look.
  LoopWatchdog(Progress progress, Feed feed, std::chrono::microseconds timeout);
  ~LoopWatchdog();
  LoopWatchdog(const LoopWatchdog&) = delete;
  LoopWatchdog& operator=(const LoopWatchdog&) = delete;

 private:
  void run();

  const Progress progress_;
  const Feed feed_;
  const std::chrono::microseconds interval_;
  Mutex mutex_;
  Condition ending_signal_;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

/// Ticks of a session's loop. Attempts to engage a device that was lost count, too, and so does a loop that
/// has ended because its recording did, or because the service shuts down.
LoopWatchdog::Progress progress_of(const Session& session);

}  // namespace hapticd::server
