#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <type_traits>

namespace hapticd::hal {

/// The newest value from one thread to one other, wait-free on both ends: each owns one of three slots, the
/// third changes hands. A value that was not fetched is replaced, so what must not be lost is written as a
/// running total.
template <class T>
class LatestValue {
  static_assert(std::is_trivially_copyable_v<T>, "only plain values may cross between threads");

 public:
  /// Publishes a value. Producer only.
  void publish(const T& value) noexcept {
    slots_[producer_] = value;
    producer_ =
        shared_.exchange(static_cast<std::uint8_t>(producer_ | kNew), std::memory_order_acq_rel) & kSlot;
  }

  /// Fetches the newest value published, or T{} if there was none. Consumer only.
  const T& fetch() noexcept {
    if ((shared_.load(std::memory_order_relaxed) & kNew) != 0) {
      consumer_ = shared_.exchange(consumer_, std::memory_order_acq_rel) & kSlot;
    }
    return slots_[consumer_];
  }

 private:
  static constexpr std::uint8_t kSlot = 3;
  static constexpr std::uint8_t kNew = 4;
  std::array<T, 3> slots_{};
  std::uint8_t producer_ = 0;
  alignas(64) std::atomic<std::uint8_t> shared_{1};
  alignas(64) std::uint8_t consumer_ = 2;
};

}  // namespace hapticd::hal
