#include "tests/measure/bench/realtime/quantile_ratio.h"

#include <algorithm>
#include <random>
#include <stdexcept>

namespace hapticd::bench {
namespace {

constexpr int kResamples = 400;

}  // namespace

LatencyDistribution sum_of(const std::vector<LatencyDistribution>& rounds) {
  LatencyDistribution sum;
  for (const LatencyDistribution& round : rounds) sum += round;
  return sum;
}

QuantileRatio quantile_ratio(const std::vector<LatencyDistribution>& a,
                             const std::vector<LatencyDistribution>& b, double share) {
  if (a.size() != b.size()) throw std::logic_error("rounds that are not pairs");
  const double value = sum_of(a).quantile_us(share) / sum_of(b).quantile_us(share);
  if (a.size() < 2) return {value, value, value};
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> any(0, a.size() - 1);
  std::vector<double> ratios;
  for (int i = 0; i < kResamples; ++i) {
    LatencyDistribution of_a;
    LatencyDistribution of_b;
    for (std::size_t n = 0; n < a.size(); ++n) {
      const std::size_t round = any(random);
      of_a += a[round];
      of_b += b[round];
    }
    ratios.push_back(of_a.quantile_us(share) / of_b.quantile_us(share));
  }
  std::sort(ratios.begin(), ratios.end());
  return {value, ratios[kResamples / 20], ratios[kResamples - 1 - kResamples / 20]};
}

}  // namespace hapticd::bench
