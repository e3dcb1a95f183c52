#pragma once

#include <chrono>
#include <thread>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd::server {

/// Ends a wait for a client's next message that takes too long: gRPC's own wait has no deadline. The time
/// between two waits does not count.
class SilenceMonitor {
 public:
  /// `on_silence`: called once, in another thread, when one wait has lasted `limit`.
  SilenceMonitor(std::chrono::milliseconds limit, Callback<void()> on_silence);
  ~SilenceMonitor();
  SilenceMonitor(const SilenceMonitor&) = delete;
  SilenceMonitor& operator=(const SilenceMonitor&) = delete;

  /// Runs `wait`, which returns what it waited for, under the watch.
  template <class Wait>
  auto during(Wait wait) {
    begin();
    const auto result = wait();
    end();
    return result;
  }
  bool was_silent() const;

 private:
  using Clock = std::chrono::steady_clock;
  void begin();
  void end();
  void run();

  const std::chrono::milliseconds limit_;
  const Callback<void()> on_silence_;
  mutable Mutex mutex_;
  Condition changed_;
  Clock::time_point until_ GUARDED_BY(mutex_) =
      Clock::time_point::max();  ///< of the wait; max() = without end
  bool was_silent_ GUARDED_BY(mutex_) = false;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
