#pragma once

#include <vector>

#include "hapticd/v1/rig.pb.h"

namespace hapticd::bench {

/// How often something took how long, as bins that rise and do not overlap.
struct LatencyDistribution {
  struct Bin {
    double from_us = 0.0;
    double up_to_us = 0.0;
    double count = 0.0;
  };
  std::vector<Bin> bins{};

  double count() const;
  /// Quantile (0 … 1), with what a bin holds spread evenly over it; NaN if nothing was counted.
  double quantile_us(double share) const;
  double max_us() const { return quantile_us(1.0); }
  /// The share that took longer than each bin's edge; what a histogram looks like when its tail matters.
  std::vector<double> beyond() const;

  LatencyDistribution& operator+=(const LatencyDistribution& other);
};

/// What happened between two answers of the daemon.
LatencyDistribution between(const v1::LatencySummary& before, const v1::LatencySummary& after);

}  // namespace hapticd::bench
