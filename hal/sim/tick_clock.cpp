#include "hal/sim/tick_clock.h"

#include <cmath>

namespace hapticd::sim {

TickClock::TickClock(double rate_hz, const Conditions& conditions,
                     std::shared_ptr<const TickIntervals> sequence, std::uint64_t seed) noexcept
    : rate_hz_(rate_hz),
      conditions_(conditions),
      sequence_(std::move(sequence)),
      random_(seed ^ 0x636c6f636bULL),
      irregular_(sequence_ != nullptr || conditions.late_tick_share > 0.0 ||
                 conditions.stall_interval_s > 0.0 || conditions.sensor_late_share > 0.0 ||
                 conditions.sensor_lost_share > 0.0) {}

double TickClock::lateness_us() noexcept {
  double late_us = 0.0;
  if (conditions_.late_tick_share > 0.0 && random_.uniform() < conditions_.late_tick_share) {
    late_us = -1e3 * conditions_.late_tick_ms * std::log1p(-random_.uniform());
  }
  if (conditions_.stall_interval_s > 0.0 &&
      random_.uniform() < 1.0 / (conditions_.stall_interval_s * rate_hz_)) {
    late_us += 1e3 * conditions_.stall_ms;
  }
  return late_us;
}

TickClock::Tick TickClock::next() noexcept {
  if (!irregular_) {
    ++ticks_;
    return {std::llround(1e9 * static_cast<double>(ticks_) / rate_hz_)};
  }
  if (sequence_) {
    const TickInterval& tick = (*sequence_)[at_];
    at_ = (at_ + 1) % sequence_->size();
    time_us_ += tick.interval_us;
    return {std::llround(1e3 * time_us_), std::llround(1e3 * tick.sensor_late_us), tick.sensor_lost};
  }
  const double period_us = 1e6 / rate_hz_;
  ++ticks_;
  const double even_us = static_cast<double>(ticks_) * period_us;
  time_us_ = even_us + lateness_us();
  ticks_ += static_cast<std::uint64_t>((time_us_ - even_us) / period_us);
  Tick tick{std::llround(1e3 * time_us_)};
  if (conditions_.sensor_late_share > 0.0 && random_.uniform() < conditions_.sensor_late_share) {
    tick.sensor_late_ns = std::llround(1e3 * period_us);
  }
  tick.sensor_lost = conditions_.sensor_lost_share > 0.0 && random_.uniform() < conditions_.sensor_lost_share;
  return tick;
}

}  // namespace hapticd::sim
