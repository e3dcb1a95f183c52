#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "hal/rig.h"
#include "rt/loop/engine.h"
#include "rt/loop/periodic_loop.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/sensor_claim.h"

namespace hapticd::sim {
class SimulatedRig;
}

namespace hapticd::server {

/// One rig, its engine and its loop, from the daemon's start to its end. All commands to the loop pass
/// through execute(). The loop never waits for anything here.
class Session {
 public:
  Session(std::unique_ptr<hal::Rig> rig, const rt::LoopConfig& loop);
  /// Stops.
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Starts the ticks. A device that is hardware has been engaged before.
  void start();
  /// Ends calls that wait for the loop from now on, with kUnavailable.
  void refuse_commands();
  /// Stops: zero force, then no more ticks, then the hardware is released; calls that wait for the loop end
  /// with kUnavailable.
  void stop();

  /// Opens the force sensor unless it is open, and returns when it sends samples. It stays open while
  /// there is a claim.
  hal::Result<SensorClaim> claim_sensor();
  std::vector<hal::PartReport> part_reports() const { return rig_->reports(); }
  struct Probe {
    std::vector<hal::PartReport> reports;
    std::optional<hal::Error> error;  ///< of a part that could not be opened
  };
  /// Reports of the parts, with an unused sensor opened for the moment.
  Probe probe_parts();
  /// Takes a bias; out of contact only. `forbidden` is asked last, when nothing is waited for any more: why
  /// there is to be none.
  std::optional<Refusal> bias_force_sensor(const Callback<std::optional<Refusal>()>& forbidden);
  std::optional<Refusal> home_device();

  hal::Rig& rig() { return *rig_; }
  const hal::RigInfo& rig_info() const { return rig_->info(); }
  const rt::LoopConfig& loop_config() const { return loop_config_; }
  /// True if the rig has its own time, which may run faster or slower than real time.
  bool rig_owns_clock() const { return rig_->owns_clock(); }
  /// Null on a rig of which nothing is simulated.
  sim::SimulatedRig* simulation() const { return simulation_; }
  rt::Engine& engine() { return engine_; }

  bool running() const { return loop_.running(); }
  /// True when the rig has no more data and the loop has ended by itself.
  bool exhausted() const { return started_.load() && !stopping_.load() && !loop_.running(); }
  bool stopping() const { return stopping_.load(); }
  rt::LoopStatistics statistics() const { return loop_.statistics(); }
  /// Number of times that a device's scheduler was lost; it is engaged again once a second.
  std::uint64_t clock_losses() const { return loop_.clock_losses(); }
  /// The thread that ticks; 0 before its first tick.
  pid_t ticking_thread() const { return loop_.ticking_thread(); }
  /// Requests that the system did not grant to the thread that ticks; empty before start() has returned.
  std::vector<std::string> realtime_shortcomings() const;

  /// The rig's time of the last tick.
  std::int64_t now_ns() const { return engine_.last_time_ns(); }
  std::uint64_t last_tick() const { return engine_.last_tick(); }
  /// Last reading; nothing before the first tick, and if the rig has its own time.
  std::optional<rt::RigReading> last_reading() const { return loop_.last_reading(); }

  /// Nothing, or why the loop takes no commands now.
  std::optional<Refusal> unavailable() const;
  /// Hands a command to the loop and waits for it. When the time is over or the caller has left, it is
  /// withdrawn and will not take effect later.
  Outcome<rt::EngineOutcome> execute(rt::EngineCommand command, const Caller& caller,
                                     std::chrono::nanoseconds allowance);

 private:
  friend class SensorClaim;
  std::optional<Refusal> refuse_in_contact(const char* action) const;
  void release_sensor();

  std::unique_ptr<hal::Rig> rig_;
  sim::SimulatedRig* simulation_;
  rt::Engine engine_;
  rt::LoopConfig loop_config_;
  rt::PeriodicLoop loop_;
  SerialMutex hardware_;  ///< the sensor is opened, biased and closed by one caller after the other
  int sensor_claims_ GUARDED_BY(hardware_) = 0;
  bool sensor_is_shut_ GUARDED_BY(hardware_) = false;  ///< stopped: it is not opened or closed any more
  std::atomic<bool> started_{false};
  std::atomic<bool> stopping_{false};
};

}  // namespace hapticd::server
