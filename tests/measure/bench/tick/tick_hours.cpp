#include "tests/measure/bench/tick/tick_hours.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "rt/loop/flush_denormals.h"
#include "tests/measure/bench/tick/cycle_clock.h"
#include "tests/measure/bench/tick/tick_workload.h"

namespace hapticd::bench {
namespace {

constexpr std::size_t kBatchTicks = 60;
constexpr std::size_t kBatchesPerMinute = 1000;
constexpr std::size_t kFreshTicks = 5000;
constexpr std::ptrdiff_t kLastMinutes = 30;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A tool that lies still, and the times of its batches in the present minute.
class RestingTool {
 public:
  RestingTool(std::unique_ptr<TickWorkload> workload, bool flushed)
      : workload_(std::move(workload)), flushed_(flushed) {
    lay_down();
  }

  /// Taps once more, then lies still.
  void lay_down() {
    const rt::FlushDenormals flush;
    for (std::size_t i = 0; i < workload_->size(); ++i) workload_->tick();
    workload_->lay_down();
  }

  void rest(std::size_t ticks) {
    std::optional<rt::FlushDenormals> flush;
    if (flushed_) flush.emplace();
    for (std::size_t i = 0; i < ticks; ++i) workload_->rest();
  }

  void time_batch(std::size_t batch) {
    std::optional<rt::FlushDenormals> flush;
    if (flushed_) flush.emplace();
    const std::uint64_t start = CycleClock::now();
    for (std::size_t i = 0; i < kBatchTicks; ++i) workload_->rest();
    counts_[batch] = CycleClock::now() - start;
  }

  /// Duration of a tick, in the clock's counts; median of the minute's batches.
  double minute_median() {
    const auto middle = counts_.begin() + kBatchesPerMinute / 2;
    std::nth_element(counts_.begin(), middle, counts_.end());
    return static_cast<double>(*middle) / kBatchTicks;
  }

 private:
  std::unique_ptr<TickWorkload> workload_;
  bool flushed_;
  std::array<std::uint64_t, kBatchesPerMinute> counts_{};
};

double last_minutes(const std::vector<double>& ratios) {
  const auto count = std::min(kLastMinutes, static_cast<std::ptrdiff_t>(ratios.size()));
  return median({ratios.end() - count, ratios.end()});
}

}  // namespace

hal::Result<RestingTimes> time_rest(const std::string& scene, double hours) {
  std::array<std::unique_ptr<TickWorkload>, 3> workloads;
  for (std::unique_ptr<TickWorkload>& workload : workloads) {
    auto created = TickWorkload::create(scene);
    if (!created) return created.error();
    workload = std::move(*created);
  }
  RestingTool fresh(std::move(workloads[0]), true);
  RestingTool flushed(std::move(workloads[1]), true);
  RestingTool kept(std::move(workloads[2]), false);

  const std::array<RestingTool*, 3> tools{&fresh, &flushed, &kept};
  std::vector<double> fresh_counts;
  std::vector<double> flushed_ratios;
  std::vector<double> kept_ratios;
  for (int minute = 0; minute < 60.0 * hours; ++minute) {
    fresh.lay_down();
    fresh.rest(kFreshTicks);
    for (std::size_t batch = 0; batch < kBatchesPerMinute; ++batch) {
      for (std::size_t i = 0; i < tools.size(); ++i) tools[(batch + i) % tools.size()]->time_batch(batch);
    }
    fresh_counts.push_back(fresh.minute_median());
    flushed_ratios.push_back(flushed.minute_median() / fresh_counts.back());
    kept_ratios.push_back(kept.minute_median() / fresh_counts.back());
  }
  const CycleClock clock;
  return RestingTimes{clock.ns(1) * median(fresh_counts), last_minutes(flushed_ratios),
                      *std::max_element(flushed_ratios.begin(), flushed_ratios.end()),
                      last_minutes(kept_ratios), *std::max_element(kept_ratios.begin(), kept_ratios.end())};
}

}  // namespace hapticd::bench
