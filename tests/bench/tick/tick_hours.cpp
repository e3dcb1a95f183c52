#include "tests/bench/tick/tick_hours.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "rt/loop/flush_denormals.h"
#include "tests/bench/tick/cycle_clock.h"

namespace hapticd::bench {
namespace {

constexpr std::size_t kBatchTicks = 60;
constexpr std::size_t kBatchesPerMinute = 1000;

double minute_ns(TickWorkload& workload, const CycleClock& clock) {
  std::array<std::uint64_t, kBatchesPerMinute> counts;
  for (std::uint64_t& count : counts) {
    const std::uint64_t start = CycleClock::now();
    for (std::size_t i = 0; i < kBatchTicks; ++i) workload.rest();
    count = CycleClock::now() - start;
  }
  const auto middle = counts.begin() + kBatchesPerMinute / 2;
  std::nth_element(counts.begin(), middle, counts.end());
  return clock.ns(*middle) / kBatchTicks;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

RestingTimes time_rest(TickWorkload& workload, double hours, bool flushed) {
  const CycleClock clock;
  std::optional<rt::FlushDenormals> flush;
  if (flushed) flush.emplace();
  for (std::size_t i = 0; i < workload.size(); ++i) workload.tick();
  workload.lay_down();
  std::vector<double> minutes;
  for (int minute = 0; minute < 60.0 * hours; ++minute) minutes.push_back(minute_ns(workload, clock));
  const auto first = minutes.begin();
  const auto last = minutes.end();
  const auto count = static_cast<std::ptrdiff_t>(minutes.size());
  return {median({first, first + std::min<std::ptrdiff_t>(5, count)}),
          median({last - std::min<std::ptrdiff_t>(30, count), last}), *std::max_element(first, last)};
}

}  // namespace hapticd::bench
