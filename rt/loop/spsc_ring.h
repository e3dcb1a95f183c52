#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <type_traits>

namespace hapticd::rt {

/// Queue between exactly two threads, wait-free on both ends: push and pop finish in a fixed number of steps
/// whatever the other side does. All memory is taken at construction. Chosen over a lock-free many-producer
/// queue because the real-time side must never retry; producers that are several serialise among themselves.
template <class T>
class SpscRing {
  static_assert(std::is_trivially_copyable_v<T>, "only plain values may cross between threads");

 public:
  /// Holds at least `capacity` elements (rounded up to a power of two).
  explicit SpscRing(std::size_t capacity)
      : mask_(std::bit_ceil(capacity < 2 ? std::size_t{2} : capacity) - 1),
        slots_(std::make_unique<T[]>(mask_ + 1)) {}

  /// Claims the place of the next element, to be made there and handed over by publish(); it holds what an
  /// earlier element left. nullptr when full. Producer only.
  T* claim() noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - cached_tail_ > mask_) {
      cached_tail_ = tail_.load(std::memory_order_acquire);
      if (head - cached_tail_ > mask_) return nullptr;
    }
    return &slots_[head & mask_];
  }

  /// Hands over what was made in the place that claim() gave. Producer only.
  void publish() noexcept {
    head_.store(head_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  /// Pushes an element; false, and nothing stored, when full. Producer only.
  bool push(const T& value) noexcept {
    T* const place = claim();
    if (place == nullptr) return false;
    *place = value;
    publish();
    return true;
  }

  /// Pops an element; false when empty. Consumer only.
  bool pop(T& value) noexcept {
    const T* oldest = front();
    if (oldest == nullptr) return false;
    value = *oldest;
    discard();
    return true;
  }

  /// Oldest unread element, which stays there until discard(); nullptr when empty. Consumer only.
  const T* front() noexcept {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    if (tail == cached_head_) {
      cached_head_ = head_.load(std::memory_order_acquire);
      if (tail == cached_head_) return nullptr;
    }
    return &slots_[tail & mask_];
  }

  /// Drops what front() showed. Consumer only.
  void discard() noexcept {
    tail_.store(tail_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
  }

  std::size_t capacity() const noexcept { return mask_ + 1; }

 private:
  static constexpr std::size_t kCacheLine = 64;
  const std::size_t mask_;
  const std::unique_ptr<T[]> slots_;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  std::size_t cached_tail_ = 0;  ///< producer's last view of tail_
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
  std::size_t cached_head_ = 0;  ///< consumer's last view of head_
};

}  // namespace hapticd::rt
