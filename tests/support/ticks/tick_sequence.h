#pragma once

#include <memory>
#include <string>
#include <utility>

#include "hal/error.h"
#include "hal/sim/tick_interval.h"

namespace hapticd::test {

using sim::TickInterval;
using sim::TickIntervals;

/// Intervals between ticks, recorded or made up, in order; over and over.
class TickSequence {
 public:
  explicit TickSequence(TickIntervals ticks) : ticks_(std::move(ticks)) {}

  /// Loads a recording: CSV with the columns interval_us and sensor_records (how many had arrived for the
  /// tick). How late the sensor's records came follows from their number: they are made at an even rate.
  static hal::Result<TickSequence> load(const std::string& path);
  /// Makes a regular clock on which every `every`-th tick comes `late_us` late; the one after it, if it still
  /// can, at its own time, else the next that can: whole periods are missed.
  static TickSequence late(double period_us, double late_us, int every);
  /// Sequence with `length` late ticks one after the other: each comes `late_us` after the one before was
  /// due.
  static TickSequence bursts(double period_us, double late_us, int length, int every);
  /// Makes the sensor's samples of every `every`-th tick `late_us` late, all at once.
  static TickSequence bunched(double period_us, double late_us, int every);
  /// Loses the samples of `length` ticks in a row, every `every` ticks.
  static TickSequence lost(double period_us, int length, int every);

  /// Sequence for a loop of another rate: the lateness of a tick stays what it was.
  TickSequence at_rate(double recorded_hz, double rate_hz) const;

  const TickIntervals& ticks() const noexcept { return ticks_; }
  /// Makes a copy for a simulated rig.
  std::shared_ptr<const TickIntervals> shared() const {
    return std::make_shared<const TickIntervals>(ticks_);
  }

 private:
  TickIntervals ticks_;
};

}  // namespace hapticd::test
