#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "server/watchdog/endpoint_table.h"

namespace hapticd::server {

/// The dead man: force only while all configured endpoints check in, and no pedal of them is released.
/// Without endpoints it does nothing. Any thread.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;

  /// What it has the rest of the daemon do. Called with a lock held: must be short, and must not call back.
  struct Effects {
    /// An endpoint is missing: present until it is called with false. Missing at first where there are any.
    std::function<void(bool)> missing = [](bool) {};
    /// A pedal is released: the same. Not so at first.
    std::function<void(bool)> released = [](bool) {};
    /// All are alive, and the first of them will be missing then unless it checks in again.
    std::function<void(Clock::time_point)> permit_until = [](Clock::time_point) {};
  };

  Watchdog(const WatchdogConfig& config, Effects effects);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  /// See EndpointTable::check_in().
  Outcome<CheckInAnswer> check_in(const CheckInRecord& check_in);
  /// In the order of the configuration; empty where no watchdog is configured.
  std::vector<EndpointView> views() const;

 private:
  /// What is to be logged once the lock is free: a log that blocks must not delay a check-in.
  using LogLines = std::vector<std::string>;
  /// Reports to the other parts what has changed.
  void pass_on(LogLines& lines);
  void run();

  const Effects effects_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  EndpointTable table_;
  bool missing_ = false;
  bool released_ = false;
  bool ending_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
