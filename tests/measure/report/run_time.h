#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <vector>

namespace hapticd::report {

/// Processor time of the calling thread, in ns: what others take of the machine is not in it.
inline double thread_time_ns() noexcept {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e9 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec);
}

/// Nanoseconds of the processor per item of `pass`, which works in the calling thread through `items` items
/// and returns something that depends on all of them (so that nothing is optimised away). The median over
/// passes, at least nine, for about `seconds`, after one that warms caches and branch predictors.
template <class Pass>
double run_time_ns(std::size_t items, Pass&& pass, double seconds = 0.1) {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t kMin = 9;
  [[maybe_unused]] volatile double sink = static_cast<double>(pass());
  std::vector<double> ns;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (ns.size() < kMin || Clock::now() < end) {
    const double start_ns = thread_time_ns();
    sink = static_cast<double>(pass());
    ns.push_back((thread_time_ns() - start_ns) / static_cast<double>(items));
  }
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return *middle;
}

}  // namespace hapticd::report
