#pragma once

#include <atomic>
#include <bit>
#include <cstddef>
#include <memory>
#include <span>

#include "hal/daq/board.h"

namespace hapticd::daq {

/// Scans from the acquisition's thread to the tick's, wait-free on both ends. A reader that paused gets the
/// newest scans, not the mean over its pause.
class ScanRing {
 public:
  explicit ScanRing(std::size_t capacity)
      : mask_(std::bit_ceil(capacity) - 1), slots_(std::make_unique<Scan[]>(mask_ + 1)) {}

  /// Pushes a scan; false, and nothing stored, when full. For the acquisition only.
  bool push(const Scan& scan) noexcept {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    if (head - tail_.load(std::memory_order_acquire) > mask_) return false;
    slots_[head & mask_] = scan;
    head_.store(head + 1, std::memory_order_release);
    return true;
  }

  /// Takes the newest scans that fit, oldest first; older ones are dropped and counted. For the reader only.
  std::size_t take(std::span<Scan> scans, std::size_t& dropped) noexcept {
    const std::size_t head = head_.load(std::memory_order_acquire);
    std::size_t tail = tail_.load(std::memory_order_relaxed);
    const std::size_t count = head - tail < scans.size() ? head - tail : scans.size();
    dropped = head - tail - count;
    tail += dropped;
    for (std::size_t i = 0; i < count; ++i) scans[i] = slots_[(tail + i) & mask_];
    tail_.store(head, std::memory_order_release);
    return count;
  }

  std::size_t capacity() const noexcept { return mask_ + 1; }

 private:
  static constexpr std::size_t kCacheLine = 64;
  const std::size_t mask_;
  const std::unique_ptr<Scan[]> slots_;
  alignas(kCacheLine) std::atomic<std::size_t> head_{0};
  alignas(kCacheLine) std::atomic<std::size_t> tail_{0};
};

}  // namespace hapticd::daq
