#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "hal/rig.h"
#include "rt/loop/engine.h"
#include "rt/loop/latency_histogram.h"
#include "rt/loop/rig_reading.h"
#include "rt/loop/thread_schedule.h"

namespace hapticd::rt {

/// How the loop's thread is to run. A value, checked before any thread exists.
struct LoopConfig {
  double rate_hz = 1000.0;  ///< 500 … 10000; must be the rig's
  int fifo_priority = 80;   ///< SCHED_FIFO 1 … 99; 0 = ordinary scheduling
  int cpu = -1;             ///< pin to this CPU; -1 = any
  /// 0 … 0.5 of a period: woken so long before a tick, the thread waits awake, so that what the timer is late
  /// does not become what the tick is late. Takes up to that share of a core.
  double wake_early_share = 0.05;
  bool lock_memory = true;  ///< keep what was touched in RAM
  bool keep_cpu_awake =
      true;  ///< hold /dev/cpu_dma_latency at 0: without it an idle core wakes tens of µs late
};

/// Time within a period at which the ticks of this process are due: in its middle half, between the kernel's
/// own ticks, which come at full milliseconds and take some 15 µs. Daemons on one machine differ, so that
/// they do not wait for one another.
std::int64_t tick_phase_ns(std::int64_t process, std::int64_t period_ns) noexcept;

hal::Result<LoopConfig> validate(const LoopConfig& config);

/// Everything measured about the loop, as one copy.
struct LoopStatistics {
  LatencySnapshot jitter;  ///< by how much the time between two ticks' beginnings differed from a period
  LatencySnapshot timer;   ///< how late the kernel woke the thread; nothing if a device's scheduler calls
  LatencySnapshot wakeup;  ///< how late a tick began; what the timer was late by, less what it was set early
  LatencySnapshot compute;
  LatencySnapshot device;
  std::uint64_t ticks = 0;
  std::uint64_t periods_missed = 0;
  std::uint64_t overruns_by_wakeup = 0;
  std::uint64_t overruns_by_compute = 0;
  std::uint64_t overruns_by_device = 0;
  std::uint64_t clock_losses = 0;  ///< how often a device's scheduler died, or could not be started
};

/// The thread that owns the clock of a paced rig, or lends itself to a rig that brings its own. If a device's
/// scheduler calls, the ticks run in the scheduler's thread, and ours only watches over it: then that one is
/// given the priority and the CPU, in the first call of every run, and ours stays ordinary. Ticks are due
/// tick_phase_ns() after each whole period of CLOCK_MONOTONIC; a period that was missed is skipped and
/// counted, never caught up in a burst. Runs without privileges too, and says what it lacks.
class PeriodicLoop final : private hal::ServoBody {
 public:
  PeriodicLoop(hal::Rig& rig, Engine& engine, const LoopConfig& config);
  /// Stops: the last thing written to the device is a zero force.
  ~PeriodicLoop() override;
  PeriodicLoop(const PeriodicLoop&) = delete;
  PeriodicLoop& operator=(const PeriodicLoop&) = delete;

  void start();
  void stop();
  bool running() const noexcept { return running_.load(std::memory_order_acquire); }

  LoopStatistics statistics() const noexcept;
  /// Last reading of the rig; nothing before the first tick, and on a rig with its own time.
  std::optional<RigReading> last_reading() const noexcept { return last_reading_.get(); }
  /// Clock losses, as in statistics(), for frequent readers.
  std::uint64_t clock_losses() const noexcept { return clock_losses_.load(std::memory_order_relaxed); }
  /// Requests that were not granted, each with its remedy. Complete once start() has returned, but for what a
  /// device's scheduler lacks: that shows from its first tick on.
  std::vector<std::string> shortcomings() const;
  /// Id of the thread that ticks; 0 before its first tick.
  pid_t ticking_thread() const noexcept { return ticking_thread_.load(std::memory_order_acquire); }

 private:
  void thread_main();
  void prepare_thread();
  /// Gives the calling thread, which is to tick, its priority and CPU.
  void prepare_to_tick() noexcept;
  void run_paced() noexcept;
  /// Sleeps, then waits awake for what is left. Returns when it is over.
  std::int64_t await(std::int64_t time_ns) noexcept;
  /// Runs until it is asked to stop; a device whose scheduler has died is engaged again, once a second.
  void run_by(hal::ServoClock& clock);
  /// Called by a device's own scheduler.
  void on_servo() noexcept override;
  /// Reads, computes and writes for the tick that was due at `deadline_ns`, on a thread that woke at
  /// `woken_ns`. Returns when the next one is due.
  std::int64_t tick(std::int64_t deadline_ns, std::int64_t woken_ns) noexcept;

  hal::Rig& rig_;
  Engine& engine_;
  LoopConfig config_;
  std::thread thread_;
  std::atomic<bool> stop_requested_{false};
  std::atomic<bool> prepared_{false};
  std::atomic<bool> running_{false};
  std::vector<std::string> shortcomings_;
  std::atomic<pid_t> ticking_thread_{0};
  std::atomic<int> cpu_shortfall_{0};  ///< of the thread that ticks, values of errno
  std::atomic<int> priority_shortfall_{0};

  // The clock's thread's own.
  std::int64_t period_ns_;
  std::int64_t early_ns_;
  std::int64_t begun_ns_ = 0;  ///< when the last tick did; 0 = there was none
  hal::RigSample sample_;
  TickTiming timing_;                   ///< of the tick to come, as far as known
  std::int64_t servo_deadline_ns_ = 0;  ///< when a device's scheduler is expected to call next; 0 = unknown
  bool is_first_servo_ = true;          ///< the next call of a device's scheduler is the first of a run

  LastRigReading last_reading_;
  LatencyHistogram jitter_;
  LatencyHistogram timer_;
  LatencyHistogram wakeup_;
  LatencyHistogram compute_;
  LatencyHistogram device_;
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<std::uint64_t> periods_missed_{0};
  std::atomic<std::uint64_t> overruns_by_wakeup_{0};
  std::atomic<std::uint64_t> overruns_by_compute_{0};
  std::atomic<std::uint64_t> overruns_by_device_{0};
  std::atomic<std::uint64_t> clock_losses_{0};
};

}  // namespace hapticd::rt
