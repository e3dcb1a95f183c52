#pragma once

#include <chrono>
#include <cstdint>

namespace hapticd::test {

/// CLOCK_MONOTONIC, which processes have in common.
inline std::int64_t monotonic_ns() noexcept {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace hapticd::test
