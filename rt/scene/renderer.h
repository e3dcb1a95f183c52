#pragma once

#include "hal/rig.h"
#include "hal/samples.h"
#include "rt/assist/assistance.h"
#include "rt/guard/guard.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"

namespace hapticd::rt {

/// One tick as a function: sample in, guarded command out, record aside. No clock, no I/O, no allocation, no
/// lock, no exception; the live loop, the simulator, the replay, the studies and the benchmarks all call it.
class Renderer {
 public:
  Renderer(const GuardLimits& limits, double rate_hz) noexcept
      : guard_(limits, rate_hz), assistance_(rate_hz), period_s_(1.0 / rate_hz) {}

  /// Swaps the pipeline (null: no scene, zero force) and returns the one before; the caller keeps ownership
  /// of both. The new one starts reset, and what it wants replaces the present force over 50 ms, to a scene
  /// without a real object over 20 ms, so that nothing is cut off in a hand. Without a new one force goes at
  /// once, as fast as the guard lets it.
  Pipeline* exchange(Pipeline* next, const GuardLimits& limits, const AssistanceSpec& spec = {}) noexcept;
  bool has_scene() const noexcept { return pipeline_ != nullptr; }
  /// True while an exchange takes nothing from under the hand: no scene, latched, or out of contact for long
  /// enough that no release is still fading.
  bool can_exchange_scene() const noexcept {
    return pipeline_ == nullptr || guard_.force_is_zero() || free_s_ + 0.5 * period_s_ >= kFreeS;
  }

  /// Does one tick. `record`: a new one, or one that a tick filled before; all of it is made this tick's, but
  /// for the groups of timing and truth, which are the loop's.
  hal::DeviceCommand tick(const hal::RigSample& sample, TickRecord& record) noexcept;

  void set_target(const TargetLaw& target, double ramp_s) noexcept;
  /// Raises a stop, or another fault that shows in no sample.
  void raise(GuardFault fault) noexcept { guard_.raise(fault); }
  void set_standing(FaultSet faults) noexcept { guard_.set_standing(faults); }
  /// Leaves the latch; authority then rises from zero. Refused (false) while the fault persists.
  bool clear() noexcept { return guard_.clear(); }
  const Guard& guard() const noexcept { return guard_; }
  /// Assistance that an experiment asks of the tick: all but update(), observe() and fill_record(),
  /// which are the tick's own.
  Assistance& assistance() noexcept { return assistance_; }

 private:
  /// Output of the pipeline; nothing if it is not evaluated, as for a sample that is not fit. `has_jump`: a
  /// part of the sensor's zero jumped, which is taken off.
  PipelineOutput evaluate(const hal::RigSample& sample, bool is_evaluated, bool has_jump) noexcept;
  /// Fills in the sample and, if it was evaluated, the groups of the pipeline. `assists`: the group of the
  /// assistance follows.
  void fill_record(const hal::RigSample& sample, bool is_evaluated, bool has_jump, bool assists,
                   TickRecord& record) const noexcept;
  /// Informs the pipeline of a bias, in every state of the guard.
  void watch_bias(const hal::RigSample& sample) noexcept;

  static constexpr double kHandOverS = 0.05;
  /// Time of a hand-over to a scene whose guard does not bound in free air what an object's scene leaves.
  static constexpr double kUnwatchedHandOverS = 0.02;
  static constexpr double kFreeS = 0.06;  // well beyond the longest fade

  Pipeline* pipeline_ = nullptr;
  std::uint32_t channels_ = 0;  ///< of the pipeline
  FaultSet noticed_ = 0;        ///< by the pipeline, with the last sample
  Guard guard_;
  Assistance assistance_;
  bool has_bias_serial_ = false;
  std::uint32_t bias_serial_ = 0;  ///< of the sample before
  FollowedZero zero_;              ///< of the pipeline before, as the sensor's goes on
  std::uint32_t found_count_ = 0;  ///< zeros that the guard found, as far as the pipeline knows
  hal::Vector3 hand_over_n_;       ///< of the pipeline before, when it was exchanged
  double hand_over_share_ = 0.0;
  double hand_over_s_ = kHandOverS;
  double period_s_;
  double free_s_ = 0.0;             ///< out of contact with no force wanted, up to kFreeS
  std::uint32_t generation_ = 0;    ///< scene loads and unloads so far
  bool pipeline_is_stale_ = false;  ///< a fault broke its history off: reset before the next fit sample
};

}  // namespace hapticd::rt
