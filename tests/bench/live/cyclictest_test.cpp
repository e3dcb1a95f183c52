// The yardstick's own words, read right.

#include "tests/bench/live/cyclictest.h"

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
  EXPECT_DOUBLE_EQ(wakeup->median_us, 20.0);
  EXPECT_DOUBLE_EQ(wakeup->p99_us, 40.0);
  EXPECT_DOUBLE_EQ(wakeup->p999_us, 100.0);
  EXPECT_DOUBLE_EQ(wakeup->max_us, 23456.0);
}

TEST(Cyclictest, QuantileBeyondTheHistogramIsTheMaximum) {
  const auto wakeup =
      parse_cyclictest("000020 000001\n# Max Latencies: 30000\n# Histogram Overflows: 00001\n");
  ASSERT_TRUE(wakeup);
  EXPECT_DOUBLE_EQ(wakeup->median_us, 20.0);
  EXPECT_DOUBLE_EQ(wakeup->p99_us, 30000.0);
}

TEST(Cyclictest, WithoutHistogramThereIsNothing) {
  EXPECT_FALSE(parse_cyclictest("Unable to change scheduling policy!\n"));
}

}  // namespace
}  // namespace hapticd::bench
