#pragma once

#include <cstdint>

#include "rt/signal/adaptive_window_velocity.h"
#include "rt/signal/butterworth_low_pass.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Velocity and acceleration from encoder positions (D§3.2.2): adaptive windowing, then the difference of its
/// output through a 50 Hz Butterworth filter. `Value` is the position along one axis, or along all three.
template <class Value>
class BasicMotionEstimator {
 public:
  static constexpr double kAccelerationCutoffHz = 50.0;
  BasicMotionEstimator(double position_resolution_mm, double rate_hz) noexcept;

  /// Takes the position of one tick and when it was measured. Slopes and filter go by the measured interval,
  /// so a late tick does not show as a jump in velocity. After a gap (TickInterval::is_gap) the estimate
  /// starts afresh; of two readings within kMinPeriods the second is left out: what it shows of the motion is
  /// the encoder's step, which the filter would hold until the next one.
  void update(const Value& position_mm, std::int64_t time_ns) noexcept {
    update(position_mm, timer_.update(time_ns));
  }
  /// Takes the position of one tick, measured so long after the last: by a timer that is reset with the
  /// estimate.
  void update(const Value& position_mm, const TickInterval& interval) noexcept;
  void reset() noexcept { timer_.reset(); }

  const Value& velocity_mm_per_s() const noexcept { return velocity_.velocity_mm_per_s(); }
  const Value& acceleration_mm_per_s2() const noexcept { return acceleration_.output(); }
  /// Lag of the acceleration behind the motion now: half the window and the filter's delay.
  double acceleration_lag_s() const noexcept;

 private:
  static constexpr double kMinPeriods = 0.5;  ///< between two readings that show a motion

  double rate_hz_;
  TickTimer timer_;
  BasicAdaptiveWindowVelocity<Value> velocity_;
  BasicButterworthLowPass<Value> acceleration_;
  double pending_periods_ = 0.0;  ///< of readings left out
  bool has_velocity_ = false;     ///< since the start, so that there is one to differ from
};

using MotionEstimator = BasicMotionEstimator<double>;
using ThreeAxisMotion = BasicMotionEstimator<hal::Vector3>;

}  // namespace hapticd::rt
