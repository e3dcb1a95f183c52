#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "rt/record/tick_record.h"

namespace hapticd::server {

class TelemetryHub;

/// The line for the log where the guard came to be latched between two looks at its newest record; nothing
/// where it was so already, or by a stop: the client that stops is in the log by name.
std::optional<std::string> latch_line(const rt::TickRecord& before, const rt::TickRecord& now);

/// Writes into the log when a fault latches the guard, so that one can look up afterwards why there was no
/// force. Looks five times a second, in a thread of its own: a log that takes no lines holds up nothing else.
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
