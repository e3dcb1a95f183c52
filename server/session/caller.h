#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "hal/lock/callback.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// The caller of a call, and how long it waits.
struct Caller {
  using Clock = std::chrono::steady_clock;

  Clock::time_point deadline = Clock::time_point::max();  ///< the caller's own
  Callback<bool()> cancelled = [] { return false; };      ///< true once the caller does not wait any more

  /// The state of control under which the call was admitted; 0 = the daemon's own.
  std::uint64_t lease = 0;
  /// Why the call may no longer command the rig; nothing while it may. Asked by calls that take long.
  Callback<std::optional<Refusal>()> lost = [] { return std::nullopt; };

  /// The end of the wait: the caller's deadline, but at most `allowance` from now.
  Clock::time_point until(std::chrono::nanoseconds allowance) const {
    return std::min(deadline, Clock::now() + allowance);
  }
};

/// How long a call may wait for the loop when its caller names no deadline.
inline constexpr std::chrono::seconds kDefaultTimeout{5};

}  // namespace hapticd::server
