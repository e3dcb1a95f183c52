#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "rt/record/tick_record.h"

namespace hapticd::server {

class TelemetryHub;

/// The log line if a fault latched the guard between two looks at its newest record. Nothing if it was
/// latched before, or by a stop: a stop has its own line with the client.
std::optional<std::string> latch_line(const rt::TickRecord& before, const rt::TickRecord& now);

/// Writes into the log when a fault latches the guard, so that the log explains why there was no force. Looks
/// five times a second, in a thread of its own: a log that blocks delays nothing else.
class GuardLog {
 public:
  explicit GuardLog(TelemetryHub& hub) : hub_(hub) {}
  ~GuardLog();
  GuardLog(const GuardLog&) = delete;
  GuardLog& operator=(const GuardLog&) = delete;

  void start();

 private:
  void run();

  TelemetryHub& hub_;
  std::mutex mutex_;
  std::condition_variable stop_signal_;
  bool stop_requested_ = false;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
