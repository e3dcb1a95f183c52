#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>

namespace hapticd::hal {

/// A bias that one thread asks for and the one that reads the sensor takes. One that was not taken in time is
/// withdrawn: its caller got an error, and whatever loads the sensor later must not become the zero.
class BiasRequest {
 public:
  /// Asks for one. Its number; 0 if another one is pending.
  std::uint64_t ask() noexcept;
  /// Waits for it. False: it was not taken in time, and never will be.
  bool await(std::uint64_t number, std::chrono::milliseconds timeout) noexcept;
  bool is_pending() const noexcept { return wanted_.load(std::memory_order_acquire) != 0; }
  /// Number of requests that were taken.
  std::uint64_t count() const noexcept { return count_.load(std::memory_order_acquire); }

  // The reader's, wait-free.
  /// Number of the request that is pending; 0 = none.
  std::uint64_t wanted() const noexcept { return wanted_.load(std::memory_order_acquire); }
  /// Claims a request before it is taken. False: it was withdrawn meanwhile.
  bool claim(std::uint64_t number) noexcept {
    return wanted_.compare_exchange_strong(number, 0, std::memory_order_acq_rel);
  }
  /// Notes that the request was taken.
  void note_taken(std::uint64_t number) noexcept {
    count_.fetch_add(1, std::memory_order_relaxed);
    taken_.store(number, std::memory_order_release);
  }

 private:
  bool is_taken(std::uint64_t number) const noexcept {
    return taken_.load(std::memory_order_acquire) >= number;
  }

  std::atomic<std::uint64_t> last_{0};
  std::atomic<std::uint64_t> wanted_{0};
  std::atomic<std::uint64_t> taken_{0};
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace hapticd::hal
