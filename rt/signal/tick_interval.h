#pragma once

#include <cstdint>

namespace hapticd::rt {

/// The measured time between two samples. Estimators advance by it; none takes "one period" for an interval
/// that was not one.
struct TickInterval {
  /// A motion is followed over no longer an interval: 16 ms hold a quarter of the fastest movement of a hand.
  static constexpr double kMaxFollowedS = 0.016;

  double s = 0.0;
  double periods = 1.0;  ///< of the loop
  /// Periods that have really passed, across a gap too; what an object has forgotten goes by these.
  double elapsed_periods = 1.0;
  /// Nothing is known of what happened since the sample before: there was none, too much time has passed, or
  /// time ran backwards.
  bool is_gap = true;
};

/// Measures it, from the instants the samples carry.
class TickTimer {
 public:
  explicit TickTimer(double rate_hz) noexcept : rate_hz_(rate_hz) {}

  TickInterval update(std::int64_t time_ns) noexcept {
    const double s = static_cast<double>(time_ns - last_ns_) * 1e-9;
    const bool is_gap = !started_ || !(s >= 0.0) || s > TickInterval::kMaxFollowedS;
    const bool was_started = started_;
    started_ = true;
    last_ns_ = time_ns;
    const double periods = s * rate_hz_;
    return is_gap ? TickInterval{1.0 / rate_hz_, 1.0, was_started && s > 0.0 ? periods : 1.0, true}
                  : TickInterval{s, periods, periods, false};
  }
  /// Makes the next sample one without a sample before it.
  void reset() noexcept { started_ = false; }

 private:
  double rate_hz_;
  bool started_ = false;
  std::int64_t last_ns_ = 0;
};

}  // namespace hapticd::rt
