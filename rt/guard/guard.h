#pragma once

#include <cstdint>

#include "hal/samples.h"
#include "rt/scene/tick_record.h"

namespace hapticd::rt {

/// Bounds on what may reach a device. Zero in a field means "the device's own" until resolve() fills it.
struct GuardLimits {
  double max_force_n = 0.0;             ///< magnitude
  double max_force_rate_n_per_s = 0.0;  ///< magnitude of the change; a cut to zero is exempt
  double max_power_w = 2.0;  ///< force · velocity into the hand; 2 W is a brisk push (4 N at 0.5 m/s)
  double sensor_stale_after_ms = 2.0;  ///< age of the newest force sample that latches; 0 = no sensor needed
  double resume_ramp_s = 0.5;          ///< authority 0 → 1 after a clear
};

/// The one gate to the device: finite, bounded in magnitude, rate and power; zero and latched on any fault.
class Guard {
 public:
  Guard(const GuardLimits& limits, double rate_hz) noexcept;

  /// True when the sample may enter a pipeline: finite and without fault bits. Otherwise latches.
  bool admit(const hal::RigSample& sample) noexcept;
  /// Bounds `wanted_n` and fills the record's guard group. Call once a tick, after admit().
  hal::Vector3 bound(const hal::Vector3& wanted_n, const hal::RigSample& sample, TickRecord& record) noexcept;

  void stop() noexcept { latch(GuardFault::kStopped); }
  /// True when the latch was left: the last sample must have been fit.
  bool clear() noexcept;
  void set_limits(const GuardLimits& limits) noexcept { limits_ = limits; }

  GuardState state() const noexcept { return state_; }
  GuardFault fault() const noexcept { return fault_; }

 private:
  void latch(GuardFault fault) noexcept;
  GuardFault fault_of(const hal::RigSample& sample) const noexcept;

  GuardLimits limits_;
  double period_s_;
  GuardState state_ = GuardState::kRendering;
  GuardFault fault_ = GuardFault::kNone;
  bool last_sample_fit_ = true;
  double authority_ = 1.0;
  hal::Vector3 last_force_n_;
  hal::Vector3 last_position_mm_;
  hal::Vector3 velocity_mm_per_s_;  ///< smoothed over a few ticks; only for the power bound
  bool has_position_ = false;
};

}  // namespace hapticd::rt
