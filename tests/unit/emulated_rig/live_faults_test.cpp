// Faults at the Net F/T box and at the vendor's library while force is rendered over the real transports.
// The machine may pause for as long as it likes: nothing here depends on when something happened.

#include <vector>

#include "fault_expectations.h"

namespace hapticd::test {
namespace {

using Case = FaultCase<EmulatedRig>;

/// Representative of each kind; the others are the study's.
std::vector<Case> representative() {
  std::vector<Case> cases;
  for (const Case& fault : live_fault_cases()) {
    for (const char* name :
         {"stream_taken", "saturated_counts", "status_link", "condition_latched", "unplugged", "nan_position",
          "exceeded_force", "warm_error", "calibration_lost", "output_off"}) {
      if (fault.name == name) cases.push_back(fault);
    }
  }
  return cases;
}

FaultTimeout patient() {
  FaultTimeout timeout{
      .sensor_stale_after_ms = 1000.0, .loop_gap_ms = 0.0, .stall_s = 5.0, .fifo_priority = 0};
  return timeout;
}

class LiveFaults : public testing::TestWithParam<Case> {};

TEST_P(LiveFaults, TakeTheForceAndGiveItBackGently) {
  EmulatedRig rig(rig_for_faults(patient()));
  FaultPlan plan = GetParam().plan(rig);
  plan.live = false;  // no pause spoils it
  const FaultTrial trial = observe(rig, plan);
  expect_as_the_table_says(trial, GetParam().fault);
  // The device is asked in the tick itself, so that its ticks are exact.
  const bool cuts = rt::rule_of(GetParam().fault).action == rt::FaultAction::kCut;
  if (GetParam().peer != "openhaptics" || !cuts) return;
  ASSERT_TRUE(trial.ticks_to_zero);
  EXPECT_LE(*trial.ticks_to_zero, 2);
}

INSTANTIATE_TEST_SUITE_P(All, LiveFaults, testing::ValuesIn(representative()),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace hapticd::test
