#include "rt/signal/motion_estimator.h"

#include <cmath>

namespace hapticd::rt {

namespace {
// An encoder that cannot be read finer than its step is off by up to one step between two readings.
double noise_bound_mm(double resolution_mm) noexcept {
  return resolution_mm > 0.0 ? resolution_mm : 1e-3;
}
}  // namespace

template <class Value>
BasicMotionEstimator<Value>::BasicMotionEstimator(double position_resolution_mm, double rate_hz) noexcept
    : rate_hz_(rate_hz),
      timer_(rate_hz),
      velocity_(noise_bound_mm(position_resolution_mm), rate_hz),
      acceleration_(kAccelerationCutoffHz, rate_hz) {}

template <class Value>
void BasicMotionEstimator<Value>::update(const Value& position_mm, const TickInterval& interval) noexcept {
  if (interval.is_gap) [[unlikely]] {
    velocity_.reset();
    velocity_.update(position_mm);
    acceleration_.seed(Value{});
    has_velocity_ = false;
    pending_periods_ = 0.0;
    return;
  }
  const double periods = interval.periods + pending_periods_;
  if (periods < kMinPeriods) [[unlikely]] {
    pending_periods_ = periods;
    return;
  }
  pending_periods_ = 0.0;
  const Value before = velocity_.velocity_mm_per_s();
  const Value change = velocity_.update(position_mm, periods) - before;
  acceleration_.update(has_velocity_ ? change * (rate_hz_ / periods) : Value{}, periods);
  has_velocity_ = true;
}

template <class Value>
double BasicMotionEstimator<Value>::acceleration_lag_s() const noexcept {
  // The difference of two velocities is half a period late; the window another half of its length.
  return ButterworthLowPass::low_frequency_delay_s(kAccelerationCutoffHz) +
         0.5 * (velocity_.window() + 1) / rate_hz_;
}

template class BasicMotionEstimator<double>;
template class BasicMotionEstimator<hal::Vector3>;

}  // namespace hapticd::rt
