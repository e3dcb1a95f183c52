#pragma once

#include <cstdint>

#include "rt/signal/adaptive_window_velocity.h"
#include "rt/signal/butterworth_low_pass.h"

namespace hapticd::rt {

/// Velocity and acceleration along one axis from encoder positions (D§3.2.2): adaptive windowing, then the
/// difference of its output through a 50 Hz Butterworth filter.
class MotionEstimator {
 public:
  static constexpr double kAccelerationCutoffHz = 50.0;
  static constexpr double kLongestFilledGapS = 0.016;

  MotionEstimator(double position_resolution_mm, double rate_hz) noexcept;

  /// Takes the position of one tick. Ticks that never came (a late loop, up to kLongestFilledGapS) are filled
  /// in on a straight line, so that a gap is not taken for a jump in velocity; after a longer gap the
  /// estimate starts anew.
  void update(double position_mm, std::int64_t time_ns) noexcept;
  void reset() noexcept { started_ = false; }

  double velocity_mm_per_s() const noexcept { return velocity_.velocity_mm_per_s(); }
  double acceleration_mm_per_s2() const noexcept { return acceleration_.output(); }
  /// How far the acceleration lags behind the motion now: half the window and the filter's delay.
  double acceleration_lag_s() const noexcept;

 private:
  void step(double position_mm) noexcept;
  void restart(double position_mm) noexcept;
  void fill_gap(double position_mm, double periods) noexcept;

  double rate_hz_;
  double longest_gap_periods_;
  AdaptiveWindowVelocity velocity_;
  ButterworthLowPass acceleration_;
  bool started_ = false;
  double last_position_mm_ = 0.0;
  std::int64_t last_time_ns_ = 0;
};

}  // namespace hapticd::rt
