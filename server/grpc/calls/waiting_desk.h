#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace hapticd::server {

/// One thread that waits for the loop on behalf of calls of the callback interface, which may not wait
/// themselves. It serves them even when other calls have used up the pool of threads.
class WaitingDesk {
 public:
  /// Calls that may wait at once.
  static constexpr std::size_t kMaxWaiting = 64;

  /// `name`: of its thread, at most 15 characters.
  explicit WaitingDesk(const char* name);
  /// Serves what is waiting, then ends.
  ~WaitingDesk();
  WaitingDesk(const WaitingDesk&) = delete;
  WaitingDesk& operator=(const WaitingDesk&) = delete;

  /// False when too many wait already.
  bool serve(std::function<void()> call);

 private:
  void run();

  const char* const name_;
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<std::function<void()>> waiting_;
  bool ending_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
