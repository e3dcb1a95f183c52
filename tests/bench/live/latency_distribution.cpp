#include "tests/bench/live/latency_distribution.h"

#include <limits>
#include <map>

namespace hapticd::bench {
namespace {

std::vector<LatencyDistribution::Bin> bins_of(const std::map<double, double>& counts) {
  std::vector<LatencyDistribution::Bin> bins;
  for (const auto& [up_to_us, count] : counts) {
    if (count > 0.0) bins.push_back({up_to_us, count});
  }
  return bins;
}

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
    seen += bin.count;
    if (seen >= share * total) return bin.up_to_us;
  }
  return std::numeric_limits<double>::quiet_NaN();
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
  std::map<double, double> counts;
  for (const Bin& bin : bins) counts[bin.up_to_us] += bin.count;
  for (const Bin& bin : other.bins) counts[bin.up_to_us] += bin.count;
  bins = bins_of(counts);
  return *this;
}

LatencyDistribution between(const v1::LatencySummary& before, const v1::LatencySummary& after) {
  std::map<double, double> counts;
  for (const auto& bucket : after.buckets()) counts[bucket.up_to_us()] += static_cast<double>(bucket.count());
  for (const auto& bucket : before.buckets())
    counts[bucket.up_to_us()] -= static_cast<double>(bucket.count());
  return {bins_of(counts)};
}

}  // namespace hapticd::bench
