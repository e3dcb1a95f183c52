#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/emulated_rig/fault_cases.h"

namespace hapticd::test {

/// What the table of faults promises of any fault, by the ticks' records alone.
inline void expect_as_the_table_says(const FaultTrial& trial, rt::GuardFault fault) {
  const rt::FaultRule& rule = rt::rule_of(fault);
  ASSERT_EQ(trial.spoilt, "");
  for (const std::string& problem : trial.problems) ADD_FAILURE() << problem;
  EXPECT_NE(trial.present & rt::set_of(fault), 0U) << "it is reported";
  EXPECT_GT(trial.force_before_n, 0.5) << "there was something to take away";
  EXPECT_GT(trial.force_again_n, 0.5 * trial.force_before_n) << "and it comes back";
  if (rule.action == rt::FaultAction::kWarn) {
    EXPECT_EQ(trial.state, rt::GuardState::kRendering);
    EXPECT_GT(trial.recovered_n, 0.5);
    return;
  }
  ASSERT_TRUE(trial.ticks_to_zero);
  const bool latches = rule.clearing != rt::FaultClearing::kItself;
  EXPECT_EQ(trial.state, latches ? rt::GuardState::kLatched : rt::GuardState::kSuspended);
  if (rule.action == rt::FaultAction::kCut && trial.status_ticks_to_zero) {
    EXPECT_EQ(*trial.status_ticks_to_zero, 0) << "no force goes with a sample that is not fit";
  }
  // Force comes back over the ramp: no more at once than a hundredth of all there is, and what a contact has
  // by itself.
  EXPECT_LT(trial.recovery_step_n, 0.02 * trial.force_before_n + 2.0 * trial.step_before_n);
}

}  // namespace hapticd::test
