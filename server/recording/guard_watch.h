#pragma once

#include <memory>
#include <thread>

#include "hal/lock/mutex.h"
#include "server/recording/event_board.h"
#include "server/recording/record_watch.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Looks at every record of the loop: faults, stops, what cleared them and overruns go to the board, and a
/// fault that latches the guard into the log, so that both explain why there was no force. On its own thread:
/// a log that blocks delays nothing else.
class GuardWatch {
 public:
  GuardWatch(TelemetryHub& hub, EventBoard& board) : hub_(hub), board_(board) {}
  ~GuardWatch();
  GuardWatch(const GuardWatch&) = delete;
  GuardWatch& operator=(const GuardWatch&) = delete;

  void start();

 private:
  void run();
  void take_records();
  void report(WatchedEvent watched);

  TelemetryHub& hub_;
  EventBoard& board_;
  RecordWatch watch_;
  std::shared_ptr<Subscription> subscription_;
  Mutex mutex_;
  Condition stop_signal_;
  bool stop_requested_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
