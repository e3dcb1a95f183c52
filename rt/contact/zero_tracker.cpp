#include "rt/contact/zero_tracker.h"

#include <algorithm>
#include <cmath>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {
hal::Vector3 moved(const hal::Vector3& zero, const hal::Vector3& error, double s, double rate,
                   double time_s) noexcept {
  const auto component = [&](double z, double e) { return z + s * std::clamp(e / time_s, -rate, rate); };
  return {component(zero.x, error.x), component(zero.y, error.y), component(zero.z, error.z)};
}
}  // namespace

void ZeroTracker::drift_on(const TickInterval& interval) noexcept {
  followed_.force.drift_on(interval.s);
  bound();
}

void ZeroTracker::update(const SensorZero& error, double speed_mm_per_s,
                         const TickInterval& interval) noexcept {
  followed_.force.follow(error.force_n, interval.s, std::abs(speed_mm_per_s) < kRestMmPerS);
  followed_.torque_n_mm =
      moved(followed_.torque_n_mm, error.torque_n_mm, interval.s, kTorqueRateNMmPerS, kTimeS);
  bound();
}

void ZeroTracker::take_over(const SensorZero& error, double n_per_s, const TickInterval& interval) noexcept {
  constexpr double kSettleS = 0.1;
  constexpr double kLeverMm = 60.0;
  followed_.force.shift(moved({}, error.force_n, interval.s, n_per_s, kSettleS));
  followed_.torque_n_mm =
      moved(followed_.torque_n_mm, error.torque_n_mm, interval.s, n_per_s * kLeverMm, kSettleS);
  bound();
}

void ZeroTracker::bound() noexcept {
  if (exceeds(force_n(), bound_n_)) followed_.force.shift(force_n() * (bound_n_ / norm(force_n()) - 1.0));
}

bool ZeroTracker::take_bias(std::uint32_t bias_serial) noexcept {
  if (bias_serial == followed_.bias_serial) return false;
  followed_.force.shift(force_n() * -1.0);  // it drifts on
  followed_.torque_n_mm = {};
  followed_.bias_serial = bias_serial;
  return true;
}

bool ZeroTracker::is_far() const noexcept {
  return exceeds(force_n(), 0.5 * bound_n_);
}

bool ZeroTracker::is_spent() const noexcept {
  return exceeds(force_n(), 0.999 * bound_n_);
}

FaultSet ZeroTracker::faults(bool is_unknown) const noexcept {
  if (is_spent()) return set_of(GuardFault::kSensorZeroLost);
  return is_far() || is_unknown ? set_of(GuardFault::kSensorZeroFar) : 0;
}

}  // namespace hapticd::rt
