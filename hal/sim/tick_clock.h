#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "hal/sim/base/conditions.h"
#include "hal/sim/base/random.h"
#include "hal/sim/tick_interval.h"

namespace hapticd::sim {

/// Times of the ticks of virtual time: evenly, as a sequence says, or late at random as the conditions say.
/// Ticks are late against even times; if one is late by more than a period, those in between are missed.
class TickClock {
 public:
  /// `sequence` may be null.
  TickClock(double rate_hz, const Conditions& conditions, std::shared_ptr<const TickIntervals> sequence,
            std::uint64_t seed) noexcept;

  /// True if ticks or sensor samples ever deviate from even times.
  bool irregular() const noexcept { return irregular_; }

  struct Tick {
    std::int64_t time_ns = 0;
    std::int64_t sensor_late_ns = 0;
    bool sensor_lost = false;
  };
  Tick next() noexcept;

 private:
  double lateness_us() noexcept;

  double rate_hz_;
  Conditions conditions_;
  std::shared_ptr<const TickIntervals> sequence_;
  Random random_;
  bool irregular_;
  std::uint64_t ticks_ = 0;  ///< even times passed
  std::size_t at_ = 0;       ///< in the sequence
  double time_us_ = 0.0;
};

}  // namespace hapticd::sim
