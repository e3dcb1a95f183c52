#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "hal/latest_value.h"
#include "hal/lock/mutex.h"
#include "hal/rig.h"
#include "rt/loop/spsc_ring.h"
#include "rt/record/observation.h"
#include "rt/record/tick_record.h"
#include "rt/scene/pipeline.h"
#include "rt/scene/renderer.h"

namespace hapticd::rt {

/// What a thread outside the loop may ask of the tick.
struct EngineCommand {
  enum class Kind : std::uint8_t {
    kSetTarget,
    kExchangeScene,
    kClear,
    kBeginGuide,
    kCancelGuide,
    kBeginPresentation,
    kEndPresentation,
  };
  Kind kind = Kind::kSetTarget;
  std::uint64_t at_tick = 0;    ///< not before this tick; 0 = the next one
  std::int64_t at_time_ns = 0;  ///< nor before this time of the rig
  TargetLaw target;             ///< kSetTarget
  double ramp_s = 0.0;
  Pipeline* pipeline = nullptr;    ///< kExchangeScene: the new one, or null to unload
  GuardLimits guard;               ///< kExchangeScene
  AssistanceSpec assistance;       ///< kExchangeScene
  GuideMotion guide;               ///< kBeginGuide
  bool when_exchangeable = false;  ///< nor before Renderer::can_exchange_scene()
  /// The state of control it was admitted under, see Engine::set_lease(); 0 = the daemon's own command.
  std::uint64_t lease = 0;
};

/// What became of it.
struct EngineOutcome {
  enum class Status : std::uint8_t {
    kApplied,
    kNoScene,        ///< there is nothing whose target could be set
    kFaultPersists,  ///< the guard stays latched: the last sample was unfit
    kTimedOut,       ///< the loop did not answer in time; the command is withdrawn and will not take effect
    kQueueFull,      ///< too many commands under way
    kNoWatch,        ///< the scene has no watch, or no presentation is under way
    kLeaseLost,      ///< control changed hands since it was admitted; it took no effect
  };
  Status status = Status::kTimedOut;
  std::uint64_t tick = 0;            ///< at which it took effect
  std::int64_t time_ns = 0;          ///< the rig's time of that tick
  Pipeline* retired = nullptr;       ///< kExchangeScene: the one that was loaded, now the caller's to delete
  std::uint32_t guide = 0;           ///< kBeginGuide: the motion's number
  PresentationSummary presentation;  ///< kBeginPresentation: its number; kEndPresentation: all
};

/// Connects the loop's thread with all others. The loop calls on_tick(); every other thread calls execute()
/// and stop(), and one thread reads the records. No side ever waits for a lock of the other.
class Engine final : public hal::TickHandler {
 public:
  static constexpr std::size_t kCommandSlots = 32;

  /// `record_capacity`: how many ticks of telemetry the ring holds for a slow reader (8192 = 8 s at 1 kHz).
  Engine(const hal::Rig& rig, std::size_t record_capacity = 8192);
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Maximum number of ticks by which the loop is ahead of an observer in virtual time.
  static constexpr std::size_t kMaxObserverLead = 256;

  // Before the loop runs.
  /// Sets the scene to start with, in force from the first tick on. The caller keeps ownership.
  void preload(Pipeline* pipeline, const GuardLimits& guard, const AssistanceSpec& assistance = {}) noexcept {
    renderer_.exchange(pipeline, guard, assistance);
  }

  // Does a tick, on the thread that owns the clock.
  hal::DeviceCommand on_tick(const hal::RigSample& sample) noexcept override;
  /// Times to be reported with the next record.
  void note_timing(const TickTiming& timing) noexcept { timing_ = timing; }
  /// Performs the commands that are due at this sample; a tick does so, too.
  void take_commands(const hal::RigSample& sample) noexcept;
  bool is_observed() const noexcept { return observed_.load(std::memory_order_acquire); }
  /// False without room: the next tick's record or observation is lost.
  bool has_room_for_record() noexcept { return records_.claim() != nullptr; }
  bool has_room_for_observation() noexcept { return observations_.claim() != nullptr; }

  // Any other thread.
  /// Hands the command to the loop and waits until it took effect or `timeout` is over. Callers are many;
  /// each waits by itself.
  EngineOutcome execute(const EngineCommand& command, std::chrono::nanoseconds timeout);
  /// Latches the guard at the next tick. Never blocks, never fails.
  void stop() noexcept { raise(GuardFault::kStopped); }
  /// Raises any other fault that shows in no sample: it counts at the next tick, and is over.
  void raise(GuardFault fault) noexcept { raised_.fetch_or(set_of(fault), std::memory_order_acq_rel); }
  /// Sets a fault that lasts: present from the next tick on until it is set to be over.
  void set_standing(GuardFault fault, bool present) noexcept {
    present ? standing_.fetch_or(set_of(fault), std::memory_order_acq_rel)
            : standing_.fetch_and(~set_of(fault), std::memory_order_acq_rel);
  }

  /// Permits force until this time of the rig: from then on the fault kEndpointMissing is present, even if no
  /// other thread of the process runs any more. At first there is no such time.
  void set_permit_until(std::int64_t time_ns) noexcept {
    permit_until_ns_.store(time_ns, std::memory_order_release);
  }

  /// Sets a new state of control: commands that were admitted under a lower number take no effect any more,
  /// from the tick after the present one on, however long they have been waiting. The numbers of changes
  /// rise; one that comes after a higher one changes nothing. Never blocks.
  void set_lease(std::uint64_t number) noexcept {
    std::uint64_t before = lease_.load(std::memory_order_relaxed);
    while (before < number && !lease_.compare_exchange_weak(before, number, std::memory_order_seq_cst)) {
    }
  }

  /// Last tick that was completed and the rig's time of it; from these a caller turns a time into a tick.
  std::uint64_t last_tick() const noexcept { return last_tick_.load(std::memory_order_acquire); }
  std::int64_t last_time_ns() const noexcept { return last_time_ns_.load(std::memory_order_acquire); }

  /// Renderer::can_exchange_scene() after the last tick; by the next one it may be otherwise.
  bool can_exchange_scene() const noexcept { return can_exchange_.load(std::memory_order_acquire); }

  // One other thread at a time.
  /// Record of the last completed tick, at least that of last_tick(); all zero before the first.
  const TickRecord& latest_record() noexcept { return latest_.fetch(); }

  // Pops a record; for the one thread that drains telemetry.
  bool pop_record(TickRecord& record) noexcept { return records_.pop(record); }
  /// Records lost because the ring was full.
  std::uint64_t records_dropped() const noexcept { return records_dropped_.load(std::memory_order_relaxed); }

  // The one thread that observes, if any.
  /// Hands on every tick whole from the next one on, or none. Off at first: a loop without an observer pays
  /// nothing for it. What was not popped before it is switched on is thrown away.
  void observe(bool on) noexcept;
  bool pop_observation(Observation& observation) noexcept { return observations_.pop(observation); }

 private:
  /// One command under way. `state` says whose turn it is: the caller takes it from free over reserved to
  /// waiting, the loop over performing to done, the caller back to free. A caller that gives up marks it
  /// withdrawn, and the loop frees it.
  struct Slot {
    enum State : std::uint32_t { kFree, kReserved, kWaiting, kPerforming, kDone, kWithdrawn };
    EngineCommand command;
    EngineOutcome outcome;
    std::atomic<std::uint32_t> state{kFree};
  };

  /// True if control changed hands since the command was admitted.
  bool is_stale(const EngineCommand& command) const noexcept;
  void perform(Slot& slot, const hal::RigSample& sample) noexcept;
  Slot* acquire_slot();
  void hand_on(const hal::RigSample& sample, const hal::DeviceCommand& command) noexcept;

  const hal::Rig& rig_;
  Renderer renderer_;
  TickTiming timing_;

  std::array<Slot, kCommandSlots> slots_;
  SpscRing<std::uint32_t> mailbox_;  ///< slot numbers, to the loop
  Mutex producers_;                  ///< among callers of execute(); the loop never touches it
  std::array<std::uint32_t, kCommandSlots> pending_{};  ///< the loop's own: taken, but not due yet
  std::size_t pending_count_ = 0;

  std::atomic<std::uint64_t> lease_{0};
  std::atomic<FaultSet> raised_{0};
  std::atomic<FaultSet> standing_{0};
  std::atomic<std::int64_t> permit_until_ns_{std::numeric_limits<std::int64_t>::max()};
  SpscRing<TickRecord> records_;
  TickRecord unsent_;  ///< made here while the ring is full
  hal::LatestValue<TickRecord> latest_;
  std::atomic<std::uint64_t> records_dropped_{0};
  std::atomic<bool> observed_{false};
  SpscRing<Observation> observations_;
  std::atomic<bool> can_exchange_{true};
  std::atomic<std::uint64_t> last_tick_{0};
  std::atomic<std::int64_t> last_time_ns_{0};
};

}  // namespace hapticd::rt
