#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::server {

/// CLOCK_MONOTONIC, in ns.
std::int64_t monotonic_ns();

/// Two clocks, read as close together as possible.
struct ClockReading {
  std::int64_t monotonic_ns = 0;
  std::int64_t utc_ns = 0;    ///< CLOCK_REALTIME, since 1970
  std::int64_t apart_ns = 0;  ///< ±, how far apart the two may have been read
};
ClockReading read_clocks();

/// What the kernel says about UTC.
enum class UtcKeeping : std::uint8_t { kUnknown, kSynchronized, kUnsynchronized };
struct KernelClock {
  UtcKeeping utc = UtcKeeping::kUnknown;
  std::optional<double> max_error_ms;   ///< from UTC; only if it is synchronized
  std::optional<double> frequency_ppm;  ///< how fast it makes the clocks run, against the oscillator
};
KernelClock kernel_clock();

/// Names of the programs of this machine that keep clocks, as far as they can be seen; "unknown" alone if
/// none is: a container does not see those of its host.
std::vector<std::string> clock_keepers(const std::string& processes = "/proc");

/// Name of this start of the machine; "unknown" if the kernel gives none.
std::string boot_name(const std::string& path = "/proc/sys/kernel/random/boot_id");

}  // namespace hapticd::server
