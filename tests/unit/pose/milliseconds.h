#pragma once

#include <cstdint>

namespace hapticd::pose {

/// Nanoseconds of a millisecond.
inline constexpr std::int64_t kMs = 1'000'000;

}  // namespace hapticd::pose
