#pragma once

#include <cstdint>
#include <vector>

#include "hal/recording/block.h"
#include "rt/record/tick_record.h"

namespace hapticd::server {

/// An event, and of which fault it is.
struct WatchedEvent {
  recording::Event event;
  rt::GuardFault fault = rt::GuardFault::kNone;
  bool ends_by_itself = false;
};

/// Finds in the loop's records what happened from one tick to the next: faults, stops, what cleared them,
/// scenes, overruns. The events have no time of day.
class RecordMonitor {
 public:
  /// Looks at a record; they must come in order, some may be missing.
  std::vector<WatchedEvent> look(const rt::TickRecord& record);
  /// True if, as of the newest record, a fault other than a stop keeps the force away until it is cleared: a
  /// stop changes nothing that a record shows.
  bool is_latched_without_stop() const {
    return has_last_ && last_state_ == rt::GuardState::kLatched && last_fault_ != rt::GuardFault::kStopped;
  }

 private:
  void look_at_guard(const rt::TickRecord& record, std::vector<WatchedEvent>& events) const;
  void look_at_timing(const rt::TickRecord& record, std::vector<WatchedEvent>& events);

  bool has_last_ = false;
  rt::GuardState last_state_ = rt::GuardState::kRendering;
  rt::GuardFault last_fault_ = rt::GuardFault::kNone;
  std::uint32_t last_present_ = 0;
  std::uint32_t last_scene_ = 0;
  std::uint32_t last_jump_count_ = 0;
  std::int64_t next_overrun_ns_ = 0;
  std::uint64_t overruns_ = 0;  ///< since the last that was reported
};

/// "sensor_stale: the newest force sample is older than …".
std::string fault_words(rt::GuardFault fault);

}  // namespace hapticd::server
