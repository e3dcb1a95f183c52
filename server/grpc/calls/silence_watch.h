#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace hapticd::server {

/// Ends a wait for a client's next message that takes too long: gRPC's own wait has no deadline. The time
/// between two waits does not count.
class SilenceWatch {
 public:
  /// `on_silence`: called once, in another thread, when one wait has lasted `limit`.
  SilenceWatch(std::chrono::milliseconds limit, std::function<void()> on_silence);
  ~SilenceWatch();
  SilenceWatch(const SilenceWatch&) = delete;
  SilenceWatch& operator=(const SilenceWatch&) = delete;

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
  const std::function<void()> on_silence_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Clock::time_point until_ = Clock::time_point::max();  ///< of the wait; max() = without end
  bool was_silent_ = false;
  bool ending_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
