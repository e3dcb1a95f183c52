#pragma once

#include <chrono>
#include <string>

#include "hapticd/v1/safety.pb.h"

namespace hapticd::client {

/// Path by which a stop arrived, of the two that are used at once.
enum class StopPath {
  kStopPort,  ///< the daemon's own path for stops: see stop_by_stop_port()
  kService,   ///< SafetyService.Stop
};

/// What became of a stop.
struct StopOutcome {
  StopPath first = StopPath::kStopPort;
  std::chrono::nanoseconds after{};  ///< from the call to the first answer
  /// Answer of the service, if it came as well; else what the stop port says, which knows no earlier fault.
  v1::StopResponse answer;
  bool both_answered = false;
  std::string problem;  ///< of the other path, if it failed; empty if it was only late
};

}  // namespace hapticd::client
