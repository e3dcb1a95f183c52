#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "hal/error.h"
#include "hal/lock/mutex.h"
#include "rt/record/tick_record.h"
#include "server/rig_file/turntable_config.h"

namespace hapticd::server {

/// Whether the table may turn, by the loop's last record. Any thread; never waits.
class Interlock {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Interlock(const InterlockConfig& config) : config_(config) {}

  /// Nothing, or why the table must not turn at `now`. `free`: no scene sees a contact (rt::Engine::can_exchange_scene());
  /// `last`: the loop's last record. A loop without a tick for too long does not count as watching.
  std::optional<hal::Error> why_not(const rt::TickRecord& last, bool free, Clock::time_point now);

 private:
  const InterlockConfig config_;
  Mutex mutex_;
  bool seen_ GUARDED_BY(mutex_) = false;
  std::uint64_t tick_ GUARDED_BY(mutex_) = 0;
  Clock::time_point tick_seen_ GUARDED_BY(mutex_){};
  Clock::time_point force_seen_ GUARDED_BY(mutex_){};
};

}  // namespace hapticd::server
