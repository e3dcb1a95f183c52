#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "hal/samples.h"
#include "rt/guard/fault_table.h"
#include "rt/guard/oscillation_monitor.h"
#include "rt/guard/push_speed.h"
#include "rt/record/tick_record.h"

namespace hapticd::rt {

/// Bounds on what may reach a device. Zero in a field means "the device's own" until resolve() fills it.
struct GuardLimits {
  double max_force_n = 0.0;             ///< magnitude
  double max_force_rate_n_per_s = 0.0;  ///< magnitude of the change; a cut to zero is exempt
  double max_power_w = 2.0;  ///< force · velocity into the hand; 2 W is a brisk push (4 N at 0.5 m/s)
  double sensor_stale_after_ms = 2.0;  ///< age of the newest force sample that latches; 0 = no sensor needed
  double resume_ramp_s = 0.5;          ///< authority 0 → 1 after a clear
  double fall_ramp_s = 0.1;  ///< authority 1 → 0 where a fault lets force fall instead of cutting it
  /// Between two ticks, by the rig's time, before the force that stood meanwhile is cut; 0 = any.
  double loop_gap_ms = 50.0;
};

/// The one gate to the device: finite, bounded in magnitude, power and rate. What a fault does to the force
/// stands in the table of faults and nowhere here.
///
/// Limits hold from the tick in which they are set. Magnitude is also bounded by what the device can give in
/// its pose (hal::RigSample::max_force_n), tick by tick. Magnitude and power hold in every tick; the rate
/// holds as long as it does not keep a force above one of them.
///
/// Times are the samples': a tick that comes late counts for as long as it was late where force falls, and
/// for kMaxRampStepS at most where it rises. A step of force is bounded as for one period at most. A time
/// that stands still counts as one period.
class Guard {
 public:
  /// A component below this is exactly zero: nothing decays to denormal numbers.
  static constexpr double kTraceN = 1e-12;
  /// What one tick counts at most for a ramp that lets force rise: a gap is no ramp.
  static constexpr double kMaxRampStepS = 0.01;

  Guard(const GuardLimits& limits, double rate_hz) noexcept;

  /// Looks for faults; true when the sample may enter a pipeline.
  bool admit(const hal::RigSample& sample) noexcept;
  /// Bounds `wanted_n` and fills the record's guard group. Call once a tick, after admit().
  hal::Vector3 bound(const hal::Vector3& wanted_n, const hal::RigSample& sample, TickRecord& record) noexcept;

  /// A fault that shows in no sample and is over at once, such as a stop. Told with the next tick.
  void raise(GuardFault fault) noexcept;
  /// Those that show in no sample and last, such as a table that has stalled: present until set otherwise.
  void set_standing(FaultSet faults) noexcept { standing_ = faults; }
  /// Those that the pipeline notices: present until set otherwise.
  void set_noticed(FaultSet faults) noexcept { noticed_ = faults; }
  /// True when the latch was left: no fault that takes the force away may be present.
  bool clear() noexcept;
  void set_limits(const GuardLimits& limits) noexcept;

  /// What it let through last, rig frame.
  const hal::Vector3& force_n() const noexcept { return last_force_n_; }
  GuardState state() const noexcept { return state_; }
  GuardFault fault() const noexcept { return fault_; }
  /// True while a fault keeps the force at zero.
  bool force_is_zero() const noexcept { return holds_back() && authority_ == 0.0; }
  /// True once after a fault that starts the pipeline again (FaultRule::restarts).
  bool take_restart() noexcept { return std::exchange(restart_, false); }
  /// Measured time from the sample before to the one last admitted.
  double interval_s() const noexcept { return interval_s_; }
  /// The same where something rises over time: bounded by kMaxRampStepS.
  double rise_interval_s() const noexcept { return std::min(interval_s_, kMaxRampStepS); }

 private:
  bool holds_back() const noexcept {
    return state_ == GuardState::kLatched || state_ == GuardState::kSuspended;
  }
  FaultSet faults_of(const hal::RigSample& sample) noexcept;
  /// Follows time and place of a sample; true when the command oscillates.
  bool follow(const hal::RigSample& sample, bool fit) noexcept;
  /// Does what the table says about the faults of a set.
  void apply_faults(FaultSet faults) noexcept;
  void update_authority() noexcept;
  /// Within magnitude and power; adds to `limited` what was needed.
  hal::Vector3 within_bounds(hal::Vector3 force_n, double max_force_n, std::uint8_t& limited) const noexcept;

  GuardLimits limits_;
  std::int64_t stale_after_ns_ = 0;  ///< of limits_, as samples tell it; 0 = nobody listens to a sensor
  std::int64_t gap_ns_ = 0;          ///< of limits_; 0 = none is too long
  double period_s_;
  double interval_s_;  ///< see interval_s()
  GuardState state_ = GuardState::kRendering;
  GuardFault fault_ = GuardFault::kNone;
  FaultSet present_ = 0;  ///< in the last sample
  FaultSet raised_ = 0;   ///< since the last record
  FaultSet standing_ = 0;
  FaultSet noticed_ = 0;
  bool restart_ = false;  ///< see take_restart()
  bool falls_ = false;    ///< held back, but not cut: authority falls over a ramp
  double authority_ = 1.0;
  hal::Vector3 last_force_n_;
  PushSpeed speed_;
  OscillationMonitor oscillation_;
  hal::Vector3 last_position_mm_;
  std::int64_t last_position_ns_ = 0;
  bool has_position_ = false;
  std::int64_t last_time_ns_ = 0;
  bool has_time_ = false;
};

}  // namespace hapticd::rt
