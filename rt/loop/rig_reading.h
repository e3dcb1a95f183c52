#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

namespace hapticd::rt {

/// A reading of the rig: its time by the rig's own clock, and between which times of CLOCK_MONOTONIC it was
/// made.
struct RigReading {
  std::int64_t rig_time_ns = 0;
  std::int64_t begun_ns = 0;
  std::int64_t done_ns = 0;
};

/// The last reading, from the loop's thread to any number of others. The loop never waits; a reader that meets
/// it in the middle tries again.
class LastRigReading {
 public:
  /// Publishes a reading; for the loop's thread only.
  void publish(const RigReading& reading) noexcept {
    const std::uint64_t version = version_.load(std::memory_order_relaxed);
    version_.store(version + 1, std::memory_order_relaxed);
    // Each with release: who sees one of them also sees the odd number.
    rig_time_ns_.store(reading.rig_time_ns, std::memory_order_release);
    begun_ns_.store(reading.begun_ns, std::memory_order_release);
    done_ns_.store(reading.done_ns, std::memory_order_release);
    version_.store(version + 2, std::memory_order_release);
  }

  /// Nothing before the first.
  std::optional<RigReading> get() const noexcept {
    constexpr int kAttempts = 1000;
    for (int i = 0; i < kAttempts; ++i) {
      const std::uint64_t before = version_.load(std::memory_order_acquire);
      if (before == 0) return std::nullopt;
      const RigReading reading{rig_time_ns_.load(std::memory_order_acquire),
                               begun_ns_.load(std::memory_order_acquire),
                               done_ns_.load(std::memory_order_acquire)};
      if (before % 2 == 0 && version_.load(std::memory_order_relaxed) == before) return reading;
    }
    return std::nullopt;
  }

 private:
  std::atomic<std::uint64_t> version_{0};  ///< odd while it is written
  std::atomic<std::int64_t> rig_time_ns_{0};
  std::atomic<std::int64_t> begun_ns_{0};
  std::atomic<std::int64_t> done_ns_{0};
};

}  // namespace hapticd::rt
