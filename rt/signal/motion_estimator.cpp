#include "rt/signal/motion_estimator.h"

#include <cmath>

namespace hapticd::rt {

namespace {
// An encoder that cannot be read finer than its step is off by up to one step between two readings.
double noise_bound_mm(double resolution_mm) noexcept {
  return resolution_mm > 0.0 ? resolution_mm : 1e-3;
}
}  // namespace

MotionEstimator::MotionEstimator(double position_resolution_mm, double rate_hz) noexcept
    : rate_hz_(rate_hz),
      longest_gap_periods_(std::round(kLongestFilledGapS * rate_hz)),
      velocity_(noise_bound_mm(position_resolution_mm), rate_hz),
      acceleration_(kAccelerationCutoffHz, rate_hz) {}

void MotionEstimator::step(double position_mm) noexcept {
  const double before = velocity_.velocity_mm_per_s();
  acceleration_.update((velocity_.update(position_mm) - before) * rate_hz_);
}

void MotionEstimator::restart(double position_mm) noexcept {
  velocity_.reset();
  velocity_.update(position_mm);
  acceleration_.seed(0.0);
  started_ = true;
}

void MotionEstimator::fill_gap(double position_mm, double periods) noexcept {
  const int missed = static_cast<int>(std::round(periods)) - 1;
  for (int i = 1; i <= missed; ++i) {
    step(last_position_mm_ + (position_mm - last_position_mm_) * i / (missed + 1));
  }
}

void MotionEstimator::update(double position_mm, std::int64_t time_ns) noexcept {
  // Halves are rounded away from zero.
  const double periods = static_cast<double>(time_ns - last_time_ns_) * 1e-9 * rate_hz_;
  if (!started_ || periods >= longest_gap_periods_ + 0.5 || periods <= -0.5) [[unlikely]] {
    restart(position_mm);
  } else {
    if (periods >= 1.5) [[unlikely]]
      fill_gap(position_mm, periods);
    step(position_mm);
  }
  last_position_mm_ = position_mm;
  last_time_ns_ = time_ns;
}

double MotionEstimator::acceleration_lag_s() const noexcept {
  // The difference of two velocities is half a period late; the window another half of its length.
  return ButterworthLowPass::low_frequency_delay_s(kAccelerationCutoffHz) +
         0.5 * (velocity_.window() + 1) / rate_hz_;
}

}  // namespace hapticd::rt
