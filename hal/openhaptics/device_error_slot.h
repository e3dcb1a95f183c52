#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "hal/monotonic_clock.h"
#include "hal/openhaptics/hd_api.h"
#include "hal/openhaptics/hd_errors.h"

namespace hapticd::openhaptics {

/// The library keeps one stack of errors for all its devices, and each look takes all that is there. So
/// each device has a slot, and an error goes to the slot of the device it names. Wait-free.
struct DeviceErrorSlot {
  std::atomic<hd::Handle> device{hd::kInvalidHandle};
  std::atomic<std::uint32_t> fresh{0};  ///< status bits that came since they were last taken
  /// Counts in the order of hd_errors().
  std::array<std::atomic<std::uint64_t>, kHdErrorCount> counts{};
  std::array<std::atomic<std::int64_t>, kHdErrorCount> last_seen_ns{};  ///< steady clock; 0 = never
  std::atomic<int> last_internal_code{0};

  void put(const hd::ErrorInfo& error) noexcept {
    const std::size_t index = hd_error_index(error.code);
    counts[index].fetch_add(1, std::memory_order_relaxed);
    last_seen_ns[index].store(hal::monotonic_ns(), std::memory_order_relaxed);
    last_internal_code.store(error.internal_code, std::memory_order_relaxed);
    fresh.fetch_or(hd_errors()[index].status, std::memory_order_relaxed);
  }
  std::uint32_t take() noexcept { return fresh.exchange(0, std::memory_order_relaxed); }
};

}  // namespace hapticd::openhaptics
