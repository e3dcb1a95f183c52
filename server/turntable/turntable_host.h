#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "hal/lock/callback.h"
#include "hal/turntable.h"
#include "rt/record/fault.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/turntable/interlock.h"

namespace hapticd::server {

class SceneHost;
class Session;
class TelemetryHub;

/// The destination of a motion.
struct TurntableDestination {
  std::optional<double> angle_deg;
  std::string station;  ///< if there is no angle
};

/// The rig's turntable, if it has one, and its rules: it turns only while the tool is out of contact and the
/// position is fresh, one motion at a time, without scenes or targets meanwhile. Any thread.
class TurntableHost {
 public:
  /// Called during the motion, in the thread of the call; false stops the table.
  using Progress = Callback<bool(const hal::TurntableStatus&)>;

  /// `table` may be null.
  TurntableHost(std::unique_ptr<hal::Turntable> table, const InterlockConfig& interlock, Session& session,
                SceneHost& scenes, TelemetryHub& hub);
  /// Disengages.
  ~TurntableHost();
  TurntableHost(const TurntableHost&) = delete;
  TurntableHost& operator=(const TurntableHost&) = delete;

  /// Sets what is called when a motion begins and when it is over, in words, on the thread of its call. Set
  /// it before the first.
  void on_motion(Callback<void(const std::string& words)> call) { on_motion_ = std::move(call); }

  /// Stops the table and closes the port; motions end, and no other begins.
  void shutdown();

  /// Null on a rig without one.
  const hal::Turntable* table() const { return table_.get(); }
  /// Reason why it must not turn now.
  std::optional<hal::Error> interlock();

  /// Both return when the table is at rest again, or its connection is lost; they open the port if it is
  /// closed. The table stops when the caller leaves or its deadline passes.
  Outcome<hal::TurntableStatus> home(const Caller& caller, const Progress& progress);
  Outcome<hal::TurntableStatus> move_to(const TurntableDestination& destination,
                                        const hal::MotionLimits& limits, const Caller& caller,
                                        const Progress& progress);
  Outcome<hal::TurntableStatus> stop();
  Outcome<hal::TurntableStatus> clear_alarm(const Caller& caller);
  Outcome<hal::TurntableStatus> engage();
  Outcome<hal::TurntableStatus> disengage();

  /// Requires a station, for scenes that need an object under the tool: nothing when the table is at the
  /// station, homed and with a fresh position; else why the scene must not be loaded. Engages the table.
  std::optional<Refusal> require_station(const std::string& name);

 private:
  using Begin = Callback<hal::Result<std::uint64_t>()>;
  std::optional<Refusal> unavailable() const;
  std::optional<Refusal> ready();
  /// Reason why the table must stay: the scene that is loaded was loaded for its station.
  std::optional<Refusal> needed_where_it_is() const;
  Outcome<hal::TurntableStatus> perform(const Begin& begin, const Caller& caller, const Progress& progress);
  void report_motion(const std::string& words) const;
  void report_fault(rt::GuardFault fault);
  void forget_faults();
  Outcome<hal::TurntableStatus> conclude(const hal::TurntableStatus& end, const std::optional<Refusal>& left);
  Outcome<double> angle_of(const TurntableDestination& destination) const;
  void put_object(const hal::TurntableStatus& end) const;

  Session& session_;
  SceneHost& scenes_;
  TelemetryHub& hub_;
  const InterlockConfig config_;
  Interlock interlock_;
  Callback<void(const std::string&)> on_motion_ = [](const std::string&) {};
  std::atomic<bool> shutting_down_{false};
  std::unique_ptr<hal::Turntable> table_;  ///< last: its thread asks the interlock
};

}  // namespace hapticd::server
