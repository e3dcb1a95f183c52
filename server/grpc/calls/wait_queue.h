#pragma once

#include <deque>
#include <thread>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"

namespace hapticd::server {

/// One thread that waits for the loop on behalf of calls of the callback interface, which may not wait
/// themselves. It serves them even when other calls have used up the pool of threads.
class WaitQueue {
 public:
  /// Calls that may wait at once.
  static constexpr std::size_t kMaxWaiting = 64;

  /// `name`: of its thread, at most 15 characters.
  explicit WaitQueue(const char* name);
  /// Serves what is waiting, then ends.
  ~WaitQueue();
  WaitQueue(const WaitQueue&) = delete;
  WaitQueue& operator=(const WaitQueue&) = delete;

  /// False when too many wait already.
  bool serve(Callback<void()> call);

 private:
  void run();

  const char* const name_;
  Mutex mutex_;
  Condition arrived_;
  std::deque<Callback<void()>> waiting_ GUARDED_BY(mutex_);
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
