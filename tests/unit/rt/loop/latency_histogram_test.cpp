#include "rt/loop/latency_histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hapticd::rt {
namespace {

TEST(LatencyHistogram, QuantilesAreWithinASixteenthOfTheSortedOnes) {
  std::mt19937 random(2);
  std::lognormal_distribution<double> latency(10.0, 1.5);
  LatencyHistogram histogram;
  std::vector<std::int64_t> all;
  for (int i = 0; i < 100'000; ++i) {
    all.push_back(static_cast<std::int64_t>(latency(random)));
    histogram.record(all.back());
  }
  std::sort(all.begin(), all.end());
  const LatencySnapshot snapshot = histogram.snapshot();
  EXPECT_EQ(snapshot.count, all.size());
  EXPECT_EQ(snapshot.max_ns, all.back());
  for (const double q : {0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto exact = static_cast<double>(all[static_cast<std::size_t>(std::ceil(q * 100'000.0)) - 1]);
    const auto read = static_cast<double>(snapshot.quantile_ns(q));
    EXPECT_GE(read, exact) << q;
    EXPECT_LE(read, exact * (1.0 + 1.0 / 16.0) + 1.0) << q;
  }
}

TEST(LatencyHistogram, EveryValueFallsBelowItsBucketsEdgeAndAboveTheOneBefore) {
  for (std::int64_t value = 0; value < 5000; ++value) {
    LatencyHistogram histogram;
    histogram.record(value);
    histogram.record(1'000'000'000);  // keeps the maximum from clipping the edge
    EXPECT_GE(histogram.snapshot().quantile_ns(0.5), value);
    EXPECT_LE(histogram.snapshot().quantile_ns(0.5), value + value / 16 + 1);
  }
}

TEST(LatencyHistogram, SurvivesNegativeAndAbsurdValues) {
  LatencyHistogram histogram;
  histogram.record(-5);
  histogram.record(INT64_MAX / 4);
  EXPECT_EQ(histogram.snapshot().count, 2U);
  EXPECT_EQ(histogram.snapshot().quantile_ns(0.0), 0);
}

TEST(LatencyHistogram, EmptyReadsZero) {
  const LatencyHistogram histogram;
  EXPECT_EQ(histogram.snapshot().quantile_ns(0.999), 0);
  EXPECT_EQ(histogram.snapshot().mean_ns, 0.0);
}

TEST(LatencyHistogram, DifferenceOfSnapshotsIsWhatHappenedBetweenThem) {
  LatencyHistogram histogram;
  for (int i = 0; i < 100; ++i) histogram.record(10);
  const LatencySnapshot before = histogram.snapshot();
  for (int i = 0; i < 50; ++i) histogram.record(1000);
  const LatencySnapshot between = histogram.snapshot().since(before);
  EXPECT_EQ(between.count, 50U);
  EXPECT_NEAR(between.mean_ns, 1000.0, 1e-9);
  EXPECT_GE(between.quantile_ns(0.01), 1000);
}

}  // namespace
}  // namespace hapticd::rt
