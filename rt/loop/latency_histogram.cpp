#include "rt/loop/latency_histogram.h"

#include <algorithm>
#include <bit>

namespace hapticd::rt {

namespace {
constexpr std::size_t kSub = LatencySnapshot::kSubBuckets;
constexpr int kSubBits = std::countr_zero(kSub);

std::size_t bucket_of(std::int64_t nanoseconds) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(nanoseconds, 0));
  if (value < kSub) return static_cast<std::size_t>(value);
  const int shift = static_cast<int>(std::bit_width(value)) - 1 - kSubBits;
  const std::size_t bucket = static_cast<std::size_t>(shift + 1) * kSub + ((value >> shift) - kSub);
  return std::min(bucket, LatencySnapshot::kBuckets - 1);
}
}  // namespace

std::int64_t LatencySnapshot::upper_edge_ns(std::size_t bucket) noexcept {
  if (bucket < kSub) return static_cast<std::int64_t>(bucket);
  const std::size_t shift = bucket / kSub - 1;
  return static_cast<std::int64_t>(((bucket % kSub + kSub + 1) << shift) - 1);
}

std::int64_t LatencySnapshot::quantile_ns(double quantile) const noexcept {
  if (count == 0) return 0;
  const double rank = std::clamp(quantile, 0.0, 1.0) * static_cast<double>(count);
  double seen = 0.0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    seen += static_cast<double>(counts[bucket]);
    if (seen >= rank && counts[bucket] > 0) return std::min(upper_edge_ns(bucket), max_ns);
  }
  return max_ns;
}

LatencySnapshot LatencySnapshot::since(const LatencySnapshot& earlier) const noexcept {
  LatencySnapshot difference = *this;
  for (std::size_t i = 0; i < kBuckets; ++i) difference.counts[i] -= earlier.counts[i];
  difference.count -= earlier.count;
  const double total =
      mean_ns * static_cast<double>(count) - earlier.mean_ns * static_cast<double>(earlier.count);
  difference.mean_ns = difference.count > 0 ? total / static_cast<double>(difference.count) : 0.0;
  return difference;
}

// One writer: a load and a store suffice, no read-modify-write.
void LatencyHistogram::record(std::int64_t nanoseconds) noexcept {
  std::atomic<std::uint64_t>& bucket = counts_[bucket_of(nanoseconds)];
  bucket.store(bucket.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  sum_ns_.store(sum_ns_.load(std::memory_order_relaxed) + nanoseconds, std::memory_order_relaxed);
  if (nanoseconds > max_ns_.load(std::memory_order_relaxed))
    max_ns_.store(nanoseconds, std::memory_order_relaxed);
}

LatencySnapshot LatencyHistogram::snapshot() const noexcept {
  LatencySnapshot copy;
  for (std::size_t i = 0; i < copy.counts.size(); ++i) {
    copy.counts[i] = counts_[i].load(std::memory_order_relaxed);
    copy.count += copy.counts[i];
  }
  copy.max_ns = max_ns_.load(std::memory_order_relaxed);
  if (copy.count > 0) {
    copy.mean_ns =
        static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) / static_cast<double>(copy.count);
  }
  return copy;
}

}  // namespace hapticd::rt
