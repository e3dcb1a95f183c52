// The yardstick's own words, read right.

#include "tests/measure/bench/live/cyclictest.h"

#include <gtest/gtest.h>

namespace hapticd::bench {
namespace {

TEST(Cyclictest, HistogramBecomesQuantiles) {
  const auto wakeup = parse_cyclictest(
      "# /dev/cpu_dma_latency set to 0us\n# Histogram\n000020 000500\n000030 000485\n000040 000010\n000100 "
      "000004\n"
      "# Total: 000000999\n# Min Latencies: 00020\n# Avg Latencies: 00025\n# Max Latencies: 23456\n"
      "# Histogram Overflows: 00001\n# Histogram Overflow at cycle number:\n# Thread 0: 00017\n");
  ASSERT_TRUE(wakeup);
  EXPECT_DOUBLE_EQ(wakeup->quantile_us(0.5), 21.0);
  EXPECT_DOUBLE_EQ(wakeup->quantile_us(0.99), 40.5);
  EXPECT_DOUBLE_EQ(wakeup->quantile_us(0.999), 101.0);
  EXPECT_DOUBLE_EQ(wakeup->max_us(), 23456.0);
}

TEST(Cyclictest, QuantileBeyondTheHistogramIsTheMaximum) {
  const auto wakeup =
      parse_cyclictest("000020 000001\n# Max Latencies: 30000\n# Histogram Overflows: 00001\n");
  ASSERT_TRUE(wakeup);
  EXPECT_DOUBLE_EQ(wakeup->quantile_us(0.5), 21.0);
  EXPECT_DOUBLE_EQ(wakeup->quantile_us(0.99), 30000.0);
}

TEST(LatencyDistribution, IsWhatHappenedBetweenTwoAnswers) {
  v1::LatencySummary before;
  v1::LatencySummary after;
  const auto add = [](v1::LatencySummary& summary, double up_to_us, std::uint64_t count) {
    v1::LatencyBucket& bucket = *summary.add_buckets();
    bucket.set_from_us(0.9 * up_to_us);
    bucket.set_up_to_us(up_to_us);
    bucket.set_count(count);
  };
  add(before, 10.0, 5);
  add(before, 900.0, 1);
  add(after, 10.0, 95);
  add(after, 20.0, 9);
  add(after, 900.0, 1);
  add(after, 950.0, 1);
  LatencyDistribution passed = between(before, after);
  EXPECT_DOUBLE_EQ(passed.count(), 100.0);
  EXPECT_DOUBLE_EQ(passed.quantile_us(0.45), 9.5) << "half way through a bin of 90";
  EXPECT_DOUBLE_EQ(passed.quantile_us(0.9), 10.0);
  EXPECT_DOUBLE_EQ(passed.quantile_us(0.99), 20.0);
  EXPECT_DOUBLE_EQ(passed.max_us(), 950.0);
  passed += between(before, after);
  EXPECT_DOUBLE_EQ(passed.count(), 200.0);
  ASSERT_EQ(passed.beyond().size(), 3U);
  EXPECT_DOUBLE_EQ(passed.beyond()[0], 0.1);
  EXPECT_DOUBLE_EQ(passed.beyond()[2], 0.0);
}

TEST(Cyclictest, WithoutHistogramThereIsNothing) {
  EXPECT_FALSE(parse_cyclictest("Unable to change scheduling policy!\n"));
}

}  // namespace
}  // namespace hapticd::bench
