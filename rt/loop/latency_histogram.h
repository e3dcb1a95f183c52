#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace hapticd::rt {

/// Copy of a histogram at one moment. Buckets are log-linear: 16 a factor of two, so a quantile is exact to
/// 1/16 of itself.
struct LatencySnapshot {
  static constexpr std::size_t kSubBuckets = 16;
  static constexpr std::size_t kBuckets = 40 * kSubBuckets;  ///< up to 2^40 ns, 18 minutes
  std::array<std::uint64_t, kBuckets> counts{};
  std::uint64_t count = 0;
  std::int64_t max_ns = 0;
  double mean_ns = 0.0;

  /// Upper edge of the bucket that holds the quantile (0 … 1); 0 when nothing was recorded.
  std::int64_t quantile_ns(double quantile) const noexcept;
  /// Counts since `earlier`, a snapshot of the same histogram. The maximum stays that of the whole.
  LatencySnapshot since(const LatencySnapshot& earlier) const noexcept;
  /// Greatest value that falls into the bucket; the least is one more than the bucket before it has.
  static std::int64_t upper_edge_ns(std::size_t bucket) noexcept;
};

/// Written by one real-time thread, read by any: recording is two plain atomic stores.
class LatencyHistogram {
 public:
  void record(std::int64_t nanoseconds) noexcept;
  LatencySnapshot snapshot() const noexcept;

 private:
  std::array<std::atomic<std::uint64_t>, LatencySnapshot::kBuckets> counts_{};
  std::atomic<std::int64_t> max_ns_{0};
  std::atomic<std::int64_t> sum_ns_{0};
};

}  // namespace hapticd::rt
