#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>

namespace hapticd::text {

/// How many events of one kind are written down in a second, and how many are only counted, so that a flood
/// of them fills no log. Any thread; takes no lock.
class ReportRate {
 public:
  using Time = std::chrono::steady_clock::time_point;
  explicit ReportRate(int max_per_s) : max_per_s_(max_per_s) {}

  /// Returns, for an event that may be written down, how many before it were only counted; nothing if this
  /// one is only counted as well.
  std::optional<std::uint64_t> take(Time now) noexcept {
    const auto second = std::chrono::floor<std::chrono::seconds>(now.time_since_epoch()).count();
    if (second_.exchange(second) != second) taken_.store(0);
    if (taken_.fetch_add(1) < max_per_s_) return counted_.exchange(0);
    counted_.fetch_add(1);
    return std::nullopt;
  }

  /// Returns how many were only counted since this was said last.
  std::uint64_t take_counted() noexcept { return counted_.exchange(0); }

 private:
  const int max_per_s_;
  std::atomic<std::int64_t> second_{-1};
  std::atomic<int> taken_{0};  ///< in that second
  std::atomic<std::uint64_t> counted_{0};
};

}  // namespace hapticd::text
