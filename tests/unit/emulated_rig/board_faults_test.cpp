// Each fault of the board, the engine and the table while force is rendered, in virtual time: here the ticks
// are exact.

#include "fault_expectations.h"

namespace hapticd::test {
namespace {

using BoardCase = FaultCase<BoardRig>;

class BoardFaults : public testing::TestWithParam<BoardCase> {};

TEST_P(BoardFaults, TakeTheForceInTimeAndGiveItBackGently) {
  BoardRig rig(board_for_faults());
  const FaultPlan plan = GetParam().plan(rig);
  const FaultTrial trial = observe(rig, plan);
  expect_as_the_table_says(trial, GetParam().fault);
  if (rt::rule_of(GetParam().fault).action != rt::FaultAction::kCut || !trial.ticks_to_zero) return;
  EXPECT_LE(*trial.ticks_to_zero, 2);
  if (plan.device_obeys) {
    ASSERT_TRUE(trial.device_ticks_to_zero);
    EXPECT_LE(*trial.device_ticks_to_zero, 2);
  }
}

INSTANTIATE_TEST_SUITE_P(All, BoardFaults, testing::ValuesIn(board_fault_cases()),
                         [](const auto& made) { return made.param.name; });

}  // namespace
}  // namespace hapticd::test
