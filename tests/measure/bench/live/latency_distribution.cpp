#include "tests/measure/bench/live/latency_distribution.h"

#include <cmath>
#include <limits>
#include <map>

namespace hapticd::bench {
namespace {

using Bin = LatencyDistribution::Bin;

/// Sum of bins by where they end. What falls below zero or is nothing is left out.
class BinSum {
 public:
  void add(const Bin& bin, double times = 1.0) {
    Bin& sum = bins_.try_emplace(bin.up_to_us, Bin{bin.from_us, bin.up_to_us, 0.0}).first->second;
    sum.count += times * bin.count;
  }
  void add(const v1::LatencySummary& summary, double times) {
    for (const auto& bucket : summary.buckets())
      add(Bin{bucket.from_us(), bucket.up_to_us(), static_cast<double>(bucket.count())}, times);
  }
  std::vector<Bin> bins() const {
    std::vector<Bin> some;
    for (const auto& [up_to_us, bin] : bins_) {
      if (bin.count > 0.0) some.push_back(bin);
    }
    return some;
  }

 private:
  std::map<double, Bin> bins_;
};

}  // namespace

double LatencyDistribution::count() const {
  double total = 0.0;
  for (const Bin& bin : bins) total += bin.count;
  return total;
}

double LatencyDistribution::quantile_us(double share) const {
  const double total = count();
  double seen = 0.0;
  for (const Bin& bin : bins) {
    const double missing = share * total - seen;
    if (missing <= bin.count) return std::lerp(bin.from_us, bin.up_to_us, missing / bin.count);
    seen += bin.count;
  }
  return bins.empty() ? std::numeric_limits<double>::quiet_NaN() : bins.back().up_to_us;
}

std::vector<double> LatencyDistribution::beyond() const {
  const double total = count();
  std::vector<double> shares;
  double seen = 0.0;
  for (const Bin& bin : bins) {
    seen += bin.count;
    shares.push_back((total - seen) / total);
  }
  return shares;
}

LatencyDistribution& LatencyDistribution::operator+=(const LatencyDistribution& other) {
  BinSum sum;
  for (const Bin& bin : bins) sum.add(bin);
  for (const Bin& bin : other.bins) sum.add(bin);
  bins = sum.bins();
  return *this;
}

LatencyDistribution between(const v1::LatencySummary& before, const v1::LatencySummary& after) {
  BinSum difference;
  difference.add(after, 1.0);
  difference.add(before, -1.0);
  return {difference.bins()};
}

}  // namespace hapticd::bench
