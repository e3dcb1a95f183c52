#pragma once

#include <vector>

#include "hapticd/v1/rig.pb.h"

namespace hapticd::bench {

/// How often something took how long, as bins of rising upper edge.
struct LatencyDistribution {
  struct Bin {
    double up_to_us = 0.0;
    double count = 0.0;
  };
  std::vector<Bin> bins{};

  double count() const;
  /// Upper edge of the bin that holds the quantile (0 … 1); NaN where nothing was counted.
  double quantile_us(double share) const;
  double max_us() const { return quantile_us(1.0); }
  /// The share that took longer than each bin's edge; what a histogram looks like when its tail matters.
  std::vector<double> beyond() const;

  LatencyDistribution& operator+=(const LatencyDistribution& other);
};

/// What happened between two answers of the daemon.
LatencyDistribution between(const v1::LatencySummary& before, const v1::LatencySummary& after);

}  // namespace hapticd::bench
