#pragma once

#include <memory>
#include <thread>

#include "hal/lock/mutex.h"
#include "server/recording/event_log.h"
#include "server/recording/record_monitor.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Looks at every record of the loop: faults, stops, what cleared them and overruns go to the event log, and
/// a fault that latches the guard into the log, so that both explain why there was no force. On its own
/// thread: a log that blocks delays nothing else.
class GuardMonitor {
 public:
  GuardMonitor(TelemetryHub& hub, EventLog& event_log) : hub_(hub), event_log_(event_log) {}
  ~GuardMonitor();
  GuardMonitor(const GuardMonitor&) = delete;
  GuardMonitor& operator=(const GuardMonitor&) = delete;

  void start();

 private:
  void run();
  void take_records();
  void report(WatchedEvent watched);

  TelemetryHub& hub_;
  EventLog& event_log_;
  RecordMonitor watch_;
  std::shared_ptr<Subscription> subscription_;
  Mutex mutex_;
  Condition stop_signal_;
  bool stop_requested_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
