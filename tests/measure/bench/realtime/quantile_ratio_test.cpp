#include "tests/measure/bench/realtime/quantile_ratio.h"

#include <gtest/gtest.h>

#include <cmath>

namespace hapticd::bench {
namespace {

/// A thousand ticks, ten of them late.
LatencyDistribution round_with(double late_us) {
  return {{{0.0, 10.0, 990.0}, {late_us, late_us + 10.0, 10.0}}};
}

TEST(QuantileRatio, OfEqualRoundsIsOneWithoutSpread) {
  const std::vector<LatencyDistribution> rounds(8, round_with(100.0));
  const QuantileRatio ratio = quantile_ratio(rounds, rounds, 0.999);
  EXPECT_DOUBLE_EQ(ratio.value, 1.0);
  EXPECT_DOUBLE_EQ(ratio.low, 1.0);
  EXPECT_DOUBLE_EQ(ratio.high, 1.0);
}

TEST(QuantileRatio, KeepsPairsTogether) {
  // The machine was ten times worse in every second round, for both.
  std::vector<LatencyDistribution> a;
  std::vector<LatencyDistribution> b;
  for (int round = 0; round < 8; ++round) {
    const double late_us = round % 2 == 0 ? 100.0 : 1000.0;
    b.push_back(round_with(late_us));
    a.push_back(round_with(late_us));
    for (auto& bin : a.back().bins) bin = {2.0 * bin.from_us, 2.0 * bin.up_to_us, bin.count};
  }
  const QuantileRatio ratio = quantile_ratio(a, b, 0.999);
  EXPECT_DOUBLE_EQ(ratio.value, 2.0);
  EXPECT_DOUBLE_EQ(ratio.low, 2.0);
  EXPECT_DOUBLE_EQ(ratio.high, 2.0);
}

TEST(QuantileRatio, TellsThatOneRoundDecides) {
  std::vector<LatencyDistribution> a(8, round_with(100.0));
  a.front() = round_with(1000.0);
  const std::vector<LatencyDistribution> b(8, round_with(100.0));
  const QuantileRatio ratio = quantile_ratio(a, b, 0.999);
  EXPECT_GT(ratio.value, 9.0);
  EXPECT_LT(ratio.low, 1.01) << "without that round they are alike";
  EXPECT_GE(ratio.high, ratio.value);
}

TEST(QuantileRatio, OfOneRoundHasNoSpreadAndOfNothingIsNothing) {
  const QuantileRatio one = quantile_ratio({round_with(200.0)}, {round_with(100.0)}, 0.999);
  EXPECT_EQ(one.low, one.value);
  EXPECT_EQ(one.high, one.value);
  EXPECT_TRUE(std::isnan(quantile_ratio({}, {}, 0.999).value));
  EXPECT_THROW(quantile_ratio({round_with(1.0)}, {}, 0.5), std::logic_error);
}

}  // namespace
}  // namespace hapticd::bench
