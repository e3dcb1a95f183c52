#pragma once

#include <chrono>
#include <cstdint>
#include <thread>

#if defined(__x86_64__)
#include <x86intrin.h>
#endif

namespace hapticd::bench {

/// The cheapest clock that orders what it times: the time stamp counter on x86-64, else the steady clock.
class CycleClock {
 public:
  CycleClock() : ns_per_count_(calibrated()) {}

  static std::uint64_t now() noexcept {
#if defined(__x86_64__)
    // The fences keep what is timed from moving across the reading.
    _mm_lfence();
    const std::uint64_t count = __rdtsc();
    _mm_lfence();
    return count;
#else
    return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
  }
  double ns(std::uint64_t counts) const noexcept {
    return ns_per_count_ * static_cast<double>(counts);
  }

 private:
  static double calibrated() {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const std::uint64_t first = now();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const std::uint64_t counts = now() - first;
    const std::chrono::duration<double, std::nano> elapsed = Clock::now() - start;
    return elapsed.count() / static_cast<double>(counts);
  }

  double ns_per_count_;
};

}  // namespace hapticd::bench
