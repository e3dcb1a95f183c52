#include "server/pose/rig_clock.h"

#include <algorithm>

namespace hapticd::pose {

void RigClock::follow(const rt::RigReading& reading) noexcept {
  const std::int64_t lower_ns = reading.begun_ns - reading.rig_time_ns;
  const std::int64_t upper_ns = reading.done_ns - reading.rig_time_ns;
  if (upper_ns < lower_ns) return;
  const bool agrees = known_ && lower_ns <= upper_ns_ && upper_ns >= lower_ns_;
  if (known_ && !agrees) ++restarts_;
  lower_ns_ = agrees ? std::max(lower_ns_, lower_ns) : lower_ns;
  upper_ns_ = agrees ? std::min(upper_ns_, upper_ns) : upper_ns;
  known_ = true;
}

std::optional<ClockInstant> RigClock::daemon_time(std::int64_t rig_ns) const noexcept {
  if (!known_) return std::nullopt;
  const std::int64_t width_ns = upper_ns_ - lower_ns_;
  return ClockInstant{rig_ns + lower_ns_ + width_ns / 2, (width_ns + 1) / 2};
}

}  // namespace hapticd::pose
