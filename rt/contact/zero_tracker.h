#pragma once

#include "rt/guard/fault_table.h"
#include "rt/signal/sensor_zero.h"
#include "rt/signal/tick_interval.h"

namespace hapticd::rt {

/// Follows the sensor's zero while the tool is free: it drifts with temperature, by millinewtons a second,
/// and a threshold of 15 mN would take that for an object within seconds.
///
/// A first-order lag of kTimeS, no faster than kForceRateNPerS on each axis: what moves with the hand
/// averages out, a drift of 2 mN/s is followed 4 mN late, and a contact that comes faster than that is not
/// taken in. How far the zero moved since the bias is bounded: beyond half of the bound it is a warning, at
/// the bound the sensor needs a new bias.
class ZeroTracker {
 public:
  static constexpr double kTimeS = 2.0;
  static constexpr double kForceRateNPerS = 2.5e-3;
  static constexpr double kTorqueRateNMmPerS = 0.15;  // the same force at the tip, 60 mm from the sensor
  /// Largest reading at rest that can be a zero.
  static constexpr double kMaxErrorN = 0.1;

  explicit ZeroTracker(double bound_n) noexcept : bound_n_(bound_n) {}

  /// One tick of a free tool: `error` is what the sensor read besides its zero and the tool's weight and
  /// inertia, sensor frame.
  void update(const SensorZero& error, const TickInterval& interval) noexcept;
  /// Takes over a reading that is known to be the zero's, as fast as that may be taken over.
  void take_over(const SensorZero& error, double n_per_s, const TickInterval& interval) noexcept;
  /// True if the sample came under another bias than the one before: whatever the sensor reads counts.
  bool take_bias(std::uint32_t bias_serial) noexcept;
  /// Takes over what another scene has followed.
  void adopt(const FollowedZero& followed) noexcept { followed_ = followed; }

  /// False with a bound of zero: then there is no need to look for the zero.
  bool is_followed() const noexcept { return bound_n_ > 0.0; }
  const SensorZero& zero() const noexcept { return followed_.zero; }
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
