// The force at the simulated hand while it presses, in the quick form of the study.

#include <gtest/gtest.h>

#include <ostream>
#include <string>

#include "tests/measure/study/loading/loading_study.h"

namespace hapticd::study {

void PrintTo(const LoadingCase& c, std::ostream* out) {
  *out << c.object << " at " << c.target_n_per_mm << " N/mm on " << c.device << ", " << c.dims << "D";
}

namespace {

class Loading : public testing::TestWithParam<LoadingCase> {};
INSTANTIATE_TEST_SUITE_P(Quick, Loading, testing::ValuesIn(loading_cases(true)), [](const auto& tested) {
  const LoadingCase& c = tested.param;
  return c.device + "_" + c.object + "_" + (c.target_n_per_mm < 0.5 ? "softer" : "harder");
});

TEST_P(Loading, CompensationBringsTheForceNearerWhileTheHandPresses) {
  LoadingTrial trial = GetParam().trial(10.0);
  const LoadingOutcome with = press_as_feasible(trial);
  ASSERT_EQ(with.failed, "");
  leave_uncompensated(trial.scene);
  const LoadingOutcome without = press(trial);
  ASSERT_EQ(without.failed, "");
  double most = 0.07;
  double most_of_without = 0.75;
  // A soft object that is to feel harder: what the target is ahead of it where the force begins fades in, for
  // it would be a bump; on the small device, pressed lightly, over most of the press. Nothing makes up for it.
  const bool is_sponge = GetParam().object == "sponge_block";
  const bool is_small = GetParam().device == "phantom_1_0";
  if (GetParam().target_n_per_mm > 0.5 && (is_sponge || is_small)) {
    most = !is_sponge ? 0.07 : is_small ? 0.2 : 0.08;
    most_of_without = !is_sponge ? 1.0 : is_small ? 1.2 : 0.8;
  } else if (is_sponge && is_small) {
    most_of_without = 1.0;
  }
  EXPECT_LT(with.error_mean, most_of_without * without.error_mean);
  EXPECT_LT(with.error_mean, most);
}

TEST(LoadingOfAStiffObject, IsFeltSoftFromTheFirstTenthOn) {
  // The hardest case: 2.3 N/mm are to feel like 0.3, so that every millisecond of delay is a third of the
  // force, and the small device has force for 1 N of the hand.
  for (const std::string& device : sim::device_preset_names()) {
    LoadingTrial trial = tap_loading(device, "rubber_eraser", 0.3);
    trial.force_n = device == "phantom_1_0" ? 1.0 : 2.0;
    const LoadingOutcome with = press_as_feasible(trial);
    ASSERT_EQ(with.failed, "") << device;
    leave_uncompensated(trial.scene);
    const LoadingOutcome without = press(trial);
    ASSERT_EQ(without.failed, "") << device;
    EXPECT_LT(with.error_mean, 0.5 * without.error_mean) << device;
  }
}

TEST_P(Loading, TheHandReachesTheRateItIsAskedFor) {
  for (const double rate : {2.0, 10.0}) {
    LoadingTrial trial = GetParam().trial(rate);
    const LoadingOutcome outcome = press_as_feasible(trial);
    ASSERT_EQ(outcome.failed, "");
    EXPECT_GT(outcome.max_rate_n_per_s, 0.8 * rate);
    EXPECT_LT(outcome.max_rate_n_per_s, 2.5 * rate) << "the first force rendered is a small step";
  }
}

}  // namespace
}  // namespace hapticd::study
