#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// Number of ticks of a loop in `time_s`: the nearest, at least one. A time is kept as a time and counted in
/// ticks of the rate the loop runs at.
inline std::uint32_t ticks_of(double time_s, double rate_hz) noexcept {
  constexpr double kMax = 1e9;
  return static_cast<std::uint32_t>(std::lround(std::clamp(time_s * rate_hz, 1.0, kMax)));
}

/// Number of periods that have passed within `time_s`; may be zero.
inline std::size_t whole_ticks_in(double time_s, double rate_hz) noexcept {
  constexpr double kRounding = 1e-9;
  constexpr double kMax = 1e9;
  return static_cast<std::size_t>(std::clamp(time_s * rate_hz + kRounding, 0.0, kMax));
}

}  // namespace hapticd::rt
