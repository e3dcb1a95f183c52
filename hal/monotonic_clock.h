#pragma once

#include <chrono>
#include <cstdint>

namespace hapticd::hal {

/// The steady clock, ns. Wait-free.
inline std::int64_t monotonic_ns() noexcept {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

}  // namespace hapticd::hal
