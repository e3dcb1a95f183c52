#pragma once

#include <cstdint>
#include <optional>

#include "rt/loop/rig_reading.h"

namespace hapticd::pose {

/// An instant of the daemon's clock, and how far it may be off.
struct ClockInstant {
  std::int64_t time_ns = 0;
  std::int64_t bound_ns = 0;  ///< ±
};

/// Relation of the rig's clock to CLOCK_MONOTONIC. A reading of the rig was made between two instants of it;
/// both clocks run alike, so that the bounds of all readings hold for all times, and the intersection is
/// kept. If one contradicts the others the rig has left time out (a simulated one that was held up), and what
/// was known is forgotten.
class RigClock {
 public:
  void follow(const rt::RigReading& reading) noexcept;
  /// Nothing before the first reading.
  std::optional<ClockInstant> daemon_time(std::int64_t rig_ns) const noexcept;
  /// Number of times that what was known was forgotten.
  std::uint32_t restarts() const noexcept { return restarts_; }

 private:
  bool known_ = false;
  std::int64_t lower_ns_ = 0;  ///< of daemon time minus rig time
  std::int64_t upper_ns_ = 0;
  std::uint32_t restarts_ = 0;
};

}  // namespace hapticd::pose
