#include "tests/measure/bench/tick/tick_timing.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tests/measure/bench/tick/cycle_clock.h"

namespace hapticd::bench {
namespace {

constexpr std::size_t kBatchTicks = 32;
constexpr std::size_t kSingleTicks = 200'000;

std::uint64_t quantile(std::vector<std::uint64_t>& counts, double share) {
  const auto rank = std::lround(share * static_cast<double>(counts.size() - 1));
  std::nth_element(counts.begin(), counts.begin() + rank, counts.end());
  return counts[static_cast<std::size_t>(rank)];
}

double batch_median_ns(const CycleClock& clock, std::vector<std::uint64_t>& batches) {
  if (batches.empty()) return std::numeric_limits<double>::quiet_NaN();
  return clock.ns(quantile(batches, 0.5)) / kBatchTicks;
}

/// How many ticks of the coming batch are in contact.
std::size_t contacts_ahead(const TickWorkload& workload) {
  std::size_t contacts = 0;
  for (std::size_t i = 0; i < kBatchTicks; ++i) {
    contacts += workload.in_contact((workload.next() + i) % workload.size()) ? 1 : 0;
  }
  return contacts;
}

}  // namespace

TickTimes time_ticks(TickWorkload& workload, double seconds) {
  using Clock = std::chrono::steady_clock;
  const CycleClock clock;
  for (std::size_t i = 0; i < 4 * workload.size(); ++i) workload.tick();  // warm caches and branch predictors

  std::vector<std::uint64_t> all;
  std::vector<std::uint64_t> free;
  std::vector<std::uint64_t> contact;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (Clock::now() < end) {
    const std::size_t contacts = contacts_ahead(workload);
    const std::uint64_t start = CycleClock::now();
    for (std::size_t i = 0; i < kBatchTicks; ++i) workload.tick();
    const std::uint64_t counts = CycleClock::now() - start;
    all.push_back(counts);
    if (contacts == 0) free.push_back(counts);
    if (contacts == kBatchTicks) contact.push_back(counts);
  }

  std::vector<std::uint64_t> readings(10'000);
  for (std::uint64_t& reading : readings) {
    const std::uint64_t start = CycleClock::now();
    reading = CycleClock::now() - start;
  }
  std::vector<std::uint64_t> singles(kSingleTicks);
  for (std::uint64_t& single : singles) {
    const std::uint64_t start = CycleClock::now();
    workload.tick();
    single = CycleClock::now() - start;
  }

  TickTimes times;
  times.clock_ns = clock.ns(quantile(readings, 0.5));
  times.median_ns = batch_median_ns(clock, all);
  times.free_median_ns = batch_median_ns(clock, free);
  times.contact_median_ns = batch_median_ns(clock, contact);
  times.p999_ns = std::max(0.0, clock.ns(quantile(singles, 0.999)) - times.clock_ns);
  return times;
}

}  // namespace hapticd::bench
