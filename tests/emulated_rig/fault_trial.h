#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rt/guard/fault_table.h"
#include "tests/emulated_rig/run.h"

namespace hapticd::test {

/// A fault to be made and fixed while a scene renders force in contact.
struct FaultPlan {
  rt::GuardFault fault = rt::GuardFault::kNone;
  /// What may be reported first instead, with the fault present soon after: silence is stale before it is
  /// lost.
  rt::GuardFault first = rt::GuardFault::kNone;
  std::function<void()> inject;
  /// The first tick whose sample could have known; none before that is certain.
  std::function<std::optional<std::uint64_t>()> aware;
  std::function<void()> fix;      ///< empty = the fault is over by itself
  std::function<void()> settled;  ///< called when the fault is over; may be empty
  bool lasts = true;              ///< until it is fixed: the latch must not be left before
  bool device_obeys = true;       ///< false: what has failed is the way to the motors itself
  bool live = false;              ///< stalls of the machine spoil it
  bool stalls = false;            ///< a stall is the fault
};

/// What became of the force.
struct FaultTrial {
  std::string spoilt;                 ///< by a stall of the machine or before the fault: to be repeated
  std::vector<std::string> problems;  ///< where it was not as the table of faults says; empty = all well

  rt::GuardState state = rt::GuardState::kRendering;  ///< when the force was zero
  rt::GuardFault reported = rt::GuardFault::kNone;
  rt::FaultSet present = 0;  ///< in any tick until it was fixed

  std::uint64_t aware_tick = 0;
  std::optional<int> ticks_to_zero;         ///< of the force commanded; 0 = in the very tick that knew
  std::optional<int> status_ticks_to_zero;  ///< the same from the first sample that said so in its status
  std::optional<int> device_ticks_to_zero;  ///< of the force at the device itself
  double force_before_n = 0.0;
  double step_before_n = 0.0;  ///< largest change in a period in the contact before the fault
  std::optional<bool> refused_while_it_lasted;
  double recovery_step_n = 0.0;  ///< the same from the clear, or the end of the fault, until 0.2 s after all
                                 ///< of it is given again; for a warning, from its begin
  double recovered_n = 0.0;      ///< force then, the hand still pressing
  double step_again_n = 0.0;     ///< the same when the hand lifts and presses again
  double force_again_n = 0.0;    ///< then

  std::vector<double> ticks;  ///< from 100 before the one that knew to the last before the hand lifts
  std::vector<double> force_n;
};

/// Presses, makes the fault, watches the force fall, tries to clear while it lasts, fixes, clears, watches
/// the force rise, presses again. On a run that was not used for anything yet.
FaultTrial observe(Run& run, const FaultPlan& plan);

}  // namespace hapticd::test
