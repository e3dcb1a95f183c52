#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "hal/samples.h"
#include "rt/guard/fault_table.h"
#include "rt/guard/frozen_reading.h"
#include "rt/guard/load_monitor.h"
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
  double fall_ramp_s = 0.1;            ///< authority 1 → 0 if a fault lets force fall instead of cutting it
  /// Time between two ticks, by the rig's clock, after which the force that stayed on meanwhile is cut; 0 =
  /// any.
  double loop_gap_ms = 50.0;
  /// What is rendered is a real object's, so there is force only where the sensor bears a load. Follows from
  /// the scene's kind (resolve()); no key sets it.
  bool renders_real_object = false;
  LoadMonitorParameters tool{};  ///< of such a scene
};

/// A sample that came in through the guard; only a guard makes one, and only with one does a force come out
/// of it.
class [[nodiscard]] Admission {
 public:
  Admission(Admission&&) noexcept = default;
  Admission(const Admission&) = delete;
  /// The sample may enter a pipeline.
  bool is_fit() const noexcept { return fit_; }
  /// A fault broke the pipeline's history off (FaultRule::restarts): it starts again with the next fit
  /// sample.
  bool restarts() const noexcept { return restarts_; }

 private:
  friend class Guard;
  Admission(const hal::RigSample& sample, bool fit, bool restarts) noexcept
      : sample_(sample), fit_(fit), restarts_(restarts) {}
  const hal::RigSample& sample_;
  bool fit_;
  bool restarts_;
};

/// The one gate to the device: finite, bounded in magnitude, power and rate. What a fault does to the force
/// is in the table of faults and nowhere here.
///
/// Limits hold from the tick in which they are set. Magnitude is also bounded by what the device can give in
/// its pose (hal::RigSample::max_force_n), tick by tick. Magnitude and power hold in every tick; the rate
/// holds as long as it does not keep a force above one of them.
///
/// Free air. A scene that modulates a real object has no more force than the load watch allows, whatever its
/// pipeline wants:
///
///   no load for 14 ms         kFreeAirN at most. From 5 ms on the bound comes down from the force
///                             before, so that nothing is cut off in a hand; it is there 20 ms after the
///                             contact. Once it comes down it goes on to do so until a load is sure, as below.
///   a jump is suspected       no more than kFreeAirN, or than there was before. This bound and the one above
///                             rise again by kLoadRiseNPerS; within kBackWithinS after a load, when the arm
///                             may swing, once the load has been back for kBackS: then it is sure.
///   the object has been left  none at once: LoadMonitor::is_left().
///   the zero is not proven    none at once. What comes back after this or the row above grows over
///                             kProvenRiseS.
///   the zero is unsure        what was rendered fades with kUnsureFallS; none comes back until it is sure.
///
/// Virtual walls, guides and fixtures are forces in free air by their nature. Theirs is bounded by where the
/// tip is: a wall acts only within its surface, on a tip that was seen outside; a guide and a fixture by
/// their own limits (ToolGuide, ToolFixture). They pass release() as assistance or without
/// `renders_real_object`.
///
/// Times are the samples': a tick that comes late counts for as long as it was late where force falls, and
/// for kMaxRampStepS at most where it rises. A step of force is bounded as for one period at most. A time
/// that does not advance counts as one period.
class Guard {
 public:
  /// A component below this is exactly zero: nothing decays to denormal numbers.
  static constexpr double kTraceN = 1e-12;
  /// Longest time that one tick counts for a ramp that lets force rise: a gap does not count as a ramp.
  static constexpr double kMaxRampStepS = 0.01;
  /// Force that is allowed while the sensor bears nothing.
  static constexpr double kFreeAirN = 0.3;
  /// Time after the last load that was seen at which the bound has come down: what is seen is late by some
  /// milliseconds, and all together takes no more than 20 ms.
  static constexpr double kFreeAirS = LoadMonitor::kFreeAirS;
  static constexpr double kProvenRiseS = 0.05;
  /// Time constant with which force ends while the zero is unsure.
  static constexpr double kUnsureFallS = 0.03;
  /// Rate at which the bound rises with a load: a load that is seen late makes no step in the hand.
  static constexpr double kLoadRiseNPerS = 250.0;
  /// Time without a load after which it has gone; that for which it must be back until the bound rises, if it comes
  /// back within kBackWithinS: an arm that swings shows one for less.
  static constexpr double kGoneS = 0.002;
  static constexpr double kBackS = 0.01;
  static constexpr double kBackWithinS = 0.1;
  /// Longest time since a load was seen for which it still is; that after which it was seen twice: once may be
  /// noise.
  static constexpr double kShownS = 0.9e-3;
  static constexpr double kSeenTwiceS = 1.5e-3;
  /// Time after the last load that was seen at which the bound begins to come down.
  static constexpr double kFreeAirFromS = 0.005;

  Guard(const GuardLimits& limits, double rate_hz) noexcept;

  /// Looks for faults in a sample; `noticed`: those that the pipeline saw with the sample before. Once a
  /// tick. The sample must outlive what is returned.
  Admission admit(const hal::RigSample& sample, FaultSet noticed = 0) noexcept;
  /// The force for the device: `wanted_n` of a pipeline, as far as free air allows, and `assistance_n`, both
  /// within the bounds; once for each admitted sample. `held_back`: what the pipeline bounded itself (bits of
  /// guard_limit).
  hal::Vector3 release(Admission admission, const hal::Vector3& wanted_n, std::uint8_t held_back,
                       const hal::Vector3& assistance_n = {}) noexcept;
  /// Fills the guard's group with what the last release() did.
  void fill_record(TickRecord& record) const noexcept;
  /// What was bounded in it, and what the pipeline bounded itself (bits of guard_limit).
  std::uint8_t limited() const noexcept { return limited_; }

  /// A fault that shows in no sample and is over at once, such as a stop. Reported with the next tick.
  void raise(GuardFault fault) noexcept;
  /// Sets the faults that show in no sample and last, such as a table that has stalled: present until set
  /// otherwise.
  void set_standing(FaultSet faults) noexcept { standing_ = faults; }
  /// True when the latch was left: no fault that takes the force away may be present.
  bool clear() noexcept;
  void set_limits(const GuardLimits& limits) noexcept;

  /// Whether the scene has force only where the sensor bears a load.
  bool watches_load() const noexcept { return limits_.renders_real_object; }
  /// What the sensor shows of a load.
  const LoadMonitor& load() const noexcept { return load_; }
  /// Pipeline and assistance together, as far as free air allows, before the other bounds.
  const hal::Vector3& wanted_n() const noexcept { return wanted_n_; }
  /// What it let through last, rig frame.
  const hal::Vector3& force_n() const noexcept { return last_force_n_; }
  GuardState state() const noexcept { return state_; }
  GuardFault fault() const noexcept { return fault_; }
  /// True while a fault keeps the force at zero.
  bool force_is_zero() const noexcept { return holds_back() && authority_ == 0.0; }
  /// Measured time from the sample before to the one last admitted.
  double interval_s() const noexcept { return interval_s_; }
  /// Interval for what rises over time: bounded by kMaxRampStepS.
  double rise_interval_s() const noexcept { return std::min(interval_s_, kMaxRampStepS); }

 private:
  bool holds_back() const noexcept {
    return state_ == GuardState::kLatched || state_ == GuardState::kSuspended;
  }
  FaultSet faults_of(const hal::RigSample& sample, FaultSet noticed) noexcept;
  /// Follows time and place of a sample; true when the command oscillates.
  bool follow(const hal::RigSample& sample, bool fit) noexcept;
  /// Does what the table says about the faults of a set.
  void apply_faults(FaultSet faults) noexcept;
  void update_authority() noexcept;
  /// Follows whether the sensor bears a load, and the bound with it.
  void watch_load(const hal::RigSample& sample, bool fit) noexcept;
  /// Whether a load that is seen is not what an arm shows that swings after the load before.
  bool is_load_sure() noexcept;
  /// What free air allows of a pipeline's force: infinite while the sensor bears a load.
  double max_in_free_air_n() const noexcept;
  /// Returns the force for the device: `wanted_n` and `assistance_n` within all bounds. Adds to `limited` what was bounded.
  hal::Vector3 bounded(const hal::Vector3& wanted_n, const hal::Vector3& assistance_n, double max_in_pose_n,
                       std::uint8_t& limited) noexcept;
  /// Force within magnitude and power; adds to `limited` what was needed.
  hal::Vector3 within_bounds(hal::Vector3 force_n, double max_force_n, std::uint8_t& limited) const noexcept;

  GuardLimits limits_;
  std::int64_t stale_after_ns_ = 0;  ///< of limits_, in the unit of samples; 0 = no sensor is needed
  std::int64_t gap_ns_ = 0;          ///< of limits_; 0 = none is too long
  double period_s_;
  double interval_s_;  ///< see interval_s()
  GuardState state_ = GuardState::kRendering;
  GuardFault fault_ = GuardFault::kNone;
  FaultSet present_ = 0;  ///< in the last sample
  FaultSet raised_ = 0;   ///< since the last release
  FaultSet reported_ = 0;  ///< with it: present and raised
  std::uint8_t limited_ = 0;
  FaultSet standing_ = 0;
  bool restart_ = false;  ///< a fault since the last admission asks for it
  bool falls_ = false;    ///< held back, but not cut: authority falls over a ramp
  double authority_ = 1.0;
  hal::Vector3 last_force_n_;
  LoadMonitor load_;
  FrozenReading reading_;
  hal::Vector3 wanted_n_;
  double rendered_n_ = 0.0;    ///< of a pipeline, magnitude in the last tick
  double proven_share_ = 0.0;  ///< since the zero is proven
  double loaded_n_ = 0.0;      ///< its size when a load was seen last
  double unloaded_s_ = 0.0;    ///< since a load was seen that is sure to be one, from kFreeAirFromS on
  double gone_s_ = 0.0;        ///< how long there was no load, before this one if there is
  double back_s_ = 0.0;        ///< how long it has been there since, up to kBackS
  double allowed_n_ = kFreeAirN;  ///< by the load and by what is suspected
  PushSpeed speed_;
  OscillationMonitor oscillation_;
  std::int64_t last_position_ns_ = 0;  ///< of the encoders' last reading
  std::int64_t followed_ns_ = 0;  ///< sum of the intervals, each of a second at most
  std::int64_t last_time_ns_ = 0;
  bool has_time_ = false;
};

}  // namespace hapticd::rt
