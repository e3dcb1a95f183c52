#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace hapticd::hal {

/// Finds when samples were taken that are numbered and evenly spaced, but arrive late and in bunches: the
/// instant of sample n is base + n · period. Arrivals say only that a sample was taken before; so the
/// earliest arrivals of each tenth of a second carry the line, and the others are late. The smallest delay on
/// the path is not seen and counts as none.
///
/// The period starts at the rate reported by the source and is corrected by the drift of the line. If the
/// two differ by more than 2 % at the beginning, or no rate is reported (0 Hz), the period is measured:
/// until then the arrival counts as the capture time. No allocation, no lock; one thread.
class SampleClock {
 public:
  explicit SampleClock(double rate_hz = 0.0) noexcept : period_ns_(rate_hz > 0.0 ? 1e9 / rate_hz : 0.0) {}

  /// Capture time of sample `number`, never after its arrival. Numbers only rise (modulo 2^32) between two
  /// restarts.
  std::int64_t instant_ns(std::uint32_t number, std::int64_t arrival_ns) noexcept {
    ahead_ns_ = 0.0;
    if (!anchored_) {
      begin_block(number, arrival_ns);
      time_ns_ = 0.0;
      number_ = number;
      anchored_ = true;
      return arrival_ns;
    }
    const auto steps = static_cast<double>(number - number_);
    const auto arrival = static_cast<double>(arrival_ns - base_ns_);
    time_ns_ = period_ns_ > 0.0 ? time_ns_ + steps * period_ns_ : arrival;
    number_ = number;
    if (time_ns_ > arrival) {  // no sample arrives before its capture
      if (settled_) ahead_ns_ = time_ns_ - arrival;
      drift_ns_ -= time_ns_ - arrival;
      time_ns_ = arrival;
    }
    min_delay_ns_ = std::min(min_delay_ns_, arrival - time_ns_);
    if (arrival - block_begin_ns_ >= kBlockNs) end_block(number, arrival_ns);
    return base_ns_ + static_cast<std::int64_t>(time_ns_);
  }

  /// How far the last sample's number was ahead of time, ns: more samples came than can have been captured.
  /// Zero while the period is not confirmed.
  double ahead_ns() const noexcept { return ahead_ns_; }

  /// Call it when numbers restart, or uncounted samples are missing: the arrival of the next sample counts
  /// as its capture time.
  void restart() noexcept { anchored_ = false; }

 private:
  static constexpr double kBlockNs = 1e8;
  static constexpr double kDisagreement = 0.02;
  static constexpr double kPeriodGain = 0.1;
  static constexpr int kBlocksToSettle = 3;

  void begin_block(std::uint32_t number, std::int64_t arrival_ns) noexcept {
    if (!anchored_) base_ns_ = arrival_ns;
    block_number_ = number;
    block_begin_ns_ = static_cast<double>(arrival_ns - base_ns_);
    min_delay_ns_ = std::numeric_limits<double>::infinity();
    drift_ns_ = 0.0;
  }

  void end_block(std::uint32_t number, std::int64_t arrival_ns) noexcept {
    const double length_ns = static_cast<double>(arrival_ns - base_ns_) - block_begin_ns_;
    const double samples = static_cast<double>(number - block_number_);
    if (min_delay_ns_ > 0.0 && std::isfinite(min_delay_ns_)) {
      time_ns_ += min_delay_ns_;
      drift_ns_ += min_delay_ns_;
    }
    const double disagreement = drift_ns_ / length_ns;
    if (period_ns_ == 0.0 || (!settled_ && std::abs(disagreement) > kDisagreement)) {
      period_ns_ = samples > 0.0 ? length_ns / samples : 0.0;
      agreeing_blocks_ = 0;
    } else {
      settled_ = settled_ || ++agreeing_blocks_ > kBlocksToSettle;
      period_ns_ *= 1.0 + kPeriodGain * std::clamp(disagreement, -kDisagreement, kDisagreement);
    }
    begin_block(number, arrival_ns);
  }

  double period_ns_;  ///< 0 = not known
  bool anchored_ = false;
  int agreeing_blocks_ = 0;
  bool settled_ = false;  ///< the period was confirmed
  std::int64_t base_ns_ = 0;
  double time_ns_ = 0.0;  ///< of the newest sample, since base_ns_
  std::uint32_t number_ = 0;
  double ahead_ns_ = 0.0;
  // Values of the present tenth of a second:
  double block_begin_ns_ = 0.0;
  std::uint32_t block_number_ = 0;
  double min_delay_ns_ = std::numeric_limits<double>::infinity();
  double drift_ns_ = 0.0;  ///< by how much the line was moved
};

}  // namespace hapticd::hal
