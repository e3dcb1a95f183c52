#include "rt/contact/zero_tracker.h"

#include <algorithm>

#include "rt/signal/vector.h"

namespace hapticd::rt {

namespace {
hal::Vector3 moved(const hal::Vector3& zero, const hal::Vector3& error, double s, double rate,
                   double time_s) noexcept {
  const auto component = [&](double z, double e) { return z + s * std::clamp(e / time_s, -rate, rate); };
  return {component(zero.x, error.x), component(zero.y, error.y), component(zero.z, error.z)};
}
}  // namespace

void ZeroTracker::update(const SensorZero& error, const TickInterval& interval) noexcept {
  SensorZero& zero = followed_.zero;
  zero.force_n = moved(zero.force_n, error.force_n, interval.s, kForceRateNPerS, kTimeS);
  zero.torque_n_mm = moved(zero.torque_n_mm, error.torque_n_mm, interval.s, kTorqueRateNMmPerS, kTimeS);
  bound();
}

void ZeroTracker::take_over(const SensorZero& error, double n_per_s, const TickInterval& interval) noexcept {
  constexpr double kSettleS = 0.1;
  SensorZero& zero = followed_.zero;
  zero.force_n = moved(zero.force_n, error.force_n, interval.s, n_per_s, kSettleS);
  zero.torque_n_mm = moved(zero.torque_n_mm, error.torque_n_mm, interval.s,
                           n_per_s * (kTorqueRateNMmPerS / kForceRateNPerS), kSettleS);
  bound();
}

void ZeroTracker::bound() noexcept {
  SensorZero& zero = followed_.zero;
  const double size_n = norm(zero.force_n);
  if (size_n > bound_n_) zero.force_n = zero.force_n * (bound_n_ / size_n);
}

bool ZeroTracker::take_bias(std::uint32_t bias_serial) noexcept {
  if (bias_serial == followed_.bias_serial) return false;
  followed_ = {{}, bias_serial};
  return true;
}

bool ZeroTracker::is_far() const noexcept {
  return norm(followed_.zero.force_n) > 0.5 * bound_n_;
}

bool ZeroTracker::is_spent() const noexcept {
  return norm(followed_.zero.force_n) > 0.999 * bound_n_;
}

FaultSet ZeroTracker::faults(bool is_unknown) const noexcept {
  if (is_spent()) return set_of(GuardFault::kSensorZeroLost);
  return is_far() || is_unknown ? set_of(GuardFault::kSensorZeroFar) : 0;
}

}  // namespace hapticd::rt
