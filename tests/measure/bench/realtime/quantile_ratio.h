#pragma once

#include <vector>

#include "tests/measure/bench/live/latency_distribution.h"

namespace hapticd::bench {

/// How two quantiles compare, and how sure that is.
struct QuantileRatio {
  double value = 0.0;
  double low = 0.0;  ///< 5 % and 95 % of what other choices of the same rounds would have given
  double high = 0.0;
};

LatencyDistribution sum_of(const std::vector<LatencyDistribution>& rounds);

/// The quantile of all rounds of `a` over that of `b`, pairwise measured in the same rounds (as many of each;
/// ratio of sums, not sum of ratios: a tail needs all its ticks together). Its spread is reported by a
/// bootstrap over whole rounds, because what disturbs a machine comes in bursts; a single round has none (low
/// = value = high). NaN if either has nothing.
QuantileRatio quantile_ratio(const std::vector<LatencyDistribution>& a,
                             const std::vector<LatencyDistribution>& b, double share);

}  // namespace hapticd::bench
