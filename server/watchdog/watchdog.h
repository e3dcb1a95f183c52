#pragma once

#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "hal/lock/mutex.h"
#include "rt/record/fault.h"
#include "server/watchdog/endpoint_table.h"

namespace hapticd::server {

class Session;

/// The dead man: force only while all configured endpoints check in, and no pedal of them is released.
/// Without endpoints it does nothing. Any thread.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;

  /// Raises kEndpointMissing and kPedalReleased in the session's loop, for as long as they are so; endpoints,
  /// if there are any, are missing at first. Permits force until the first of them would be missing.
  Watchdog(const WatchdogConfig& config, Session& session);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// Checks in; see EndpointTable::check_in().
  Outcome<CheckInAnswer> check_in(const CheckInRecord& check_in);
  /// Views in the order of the configuration; empty if no watchdog is configured.
  std::vector<EndpointView> views() const;

 private:
  /// What is to be logged once the lock is free: a log that blocks must not delay a check-in.
  using LogLines = std::vector<std::string>;
  /// Reports to the other parts what has changed.
  void pass_on(LogLines& lines) REQUIRES(mutex_);
  void set_fault(rt::GuardFault fault, bool present);
  void permit_until(Clock::time_point until);
  void run();

  Session& session_;
  const bool has_endpoints_;
  mutable Mutex mutex_;
  Condition wake_;
  EndpointTable table_ GUARDED_BY(mutex_);
  bool missing_ GUARDED_BY(mutex_) = false;
  bool released_ GUARDED_BY(mutex_) = false;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
