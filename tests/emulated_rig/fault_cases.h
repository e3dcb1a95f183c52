#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "tests/emulated_rig/board_rig.h"
#include "tests/emulated_rig/emulated_rig.h"
#include "tests/emulated_rig/fault_trial.h"

namespace hapticd::test {

/// A fault by what is done to which peer.
template <class Rig>
struct FaultCase {
  std::string name;    ///< unique, e.g. "silence"
  std::string peer;    ///< "netft", "openhaptics", "board", "engine", "turntable"
  std::string action;  ///< in words
  rt::GuardFault fault = rt::GuardFault::kNone;
  FaultPlan (*plan)(Rig&) = nullptr;
  friend void PrintTo(const FaultCase& made, std::ostream* out) { *out << made.name; }
};

/// Faults at the Net F/T box and at the vendor's library, live.
const std::vector<FaultCase<EmulatedRig>>& live_fault_cases();
/// Faults at the board, and those that need no peer; in virtual time.
const std::vector<FaultCase<BoardRig>>& board_fault_cases();

/// How patient guard and drivers are while a fault is observed.
struct FaultTimeout {
  double sensor_stale_after_ms = 2.0;  ///< as in any scene
  double loop_gap_ms = 50.0;
  double stall_s = 0.1;  ///< of the vendor's scheduler
  int fifo_priority = 40;
};

/// A soft object to be rendered stiffer: the device gives a clear force while the hand presses.
EmulatedRigConfig rig_for_faults(const FaultTimeout& timeout);
RunConfig board_for_faults();

}  // namespace hapticd::test
