#pragma once

#include "rt/guard/fault_table.h"
#include "rt/signal/followed_zero.h"
#include "rt/signal/sensor_zero.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Follows the sensor's zero while the tool is free: it drifts with temperature, by millinewtons a second,
/// and a threshold of 15 mN would take that for an object within seconds.
///
/// The force's zero drifts on in contact as it did before (DriftTracker); a contact that comes faster than a
/// sensor drifts is not taken in. The torque's is a first-order lag of kTimeS, no faster than
/// kTorqueRateNMmPerS on each axis. How far the zero moved since the bias is bounded: beyond half of the
/// bound it is a warning, at the bound the sensor needs a new bias.
class ZeroTracker {
 public:
  static constexpr double kTimeS = 2.0;
  static constexpr double kTorqueRateNMmPerS = 0.15;  ///< of 2.5 mN at the tip, 60 mm from the sensor
  static constexpr double kRestMmPerS = 5.0;
  /// Largest reading at rest that can be a zero.
  static constexpr double kMaxErrorN = 0.1;

  explicit ZeroTracker(double bound_n) noexcept : bound_n_(bound_n) {}

  /// A tick passes, whether the tool is free or not.
  void drift_on(const TickInterval& interval) noexcept;
  /// One tick of a free tool: `error` is what the sensor read besides its zero and the tool's weight and
  /// inertia, sensor frame. `speed_mm_per_s`: of the tip, signed or not.
  void update(const SensorZero& error, double speed_mm_per_s, const TickInterval& interval) noexcept;
  /// Takes over a reading that is known to be the zero's, as fast as that may be taken over.
  void take_over(const SensorZero& error, double n_per_s, const TickInterval& interval) noexcept;
  /// True if the sample came under another bias than the one before: whatever the sensor reads counts.
  bool take_bias(std::uint32_t bias_serial) noexcept;
  /// Takes over what another has followed.
  void adopt(const FollowedZero& followed) noexcept {
    if (is_followed()) followed_ = followed;
  }

  /// False with a bound of zero: then there is no need to look for the zero.
  bool is_followed() const noexcept { return bound_n_ > 0.0; }
  SensorZero zero() const noexcept { return {force_n(), followed_.torque_n_mm}; }
  const hal::Vector3& force_n() const noexcept { return followed_.force.value_n(); }
  const hal::Vector3& torque_n_mm() const noexcept { return followed_.torque_n_mm; }
  const FollowedZero& followed() const noexcept { return followed_; }
  bool is_far() const noexcept;    ///< beyond half of the bound
  bool is_spent() const noexcept;  ///< at the bound
  /// What both mean to the guard. `is_unknown`: the tool waits in motion on a reading of nothing.
  FaultSet faults(bool is_unknown) const noexcept;

 private:
  void bound() noexcept;

  double bound_n_;
  FollowedZero followed_{};
};

}  // namespace hapticd::rt
