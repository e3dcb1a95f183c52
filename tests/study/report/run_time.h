#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <vector>

namespace hapticd::report {

/// Nanoseconds per item of `pass`, which works through `items` items and returns something that depends on
/// all of them (so that nothing is optimised away). The median over passes, at least nine, for about
/// `seconds`, after one that warms caches and branch predictors. Run it while nothing else does.
template <class Pass>
double run_time_ns(std::size_t items, Pass&& pass, double seconds = 0.1) {
  using Clock = std::chrono::steady_clock;
  constexpr std::size_t kFewest = 9;
  [[maybe_unused]] volatile double sink = static_cast<double>(pass());
  std::vector<double> ns;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (ns.size() < kFewest || Clock::now() < end) {
    const auto start = Clock::now();
    sink = static_cast<double>(pass());
    const std::chrono::duration<double, std::nano> took = Clock::now() - start;
    ns.push_back(took.count() / static_cast<double>(items));
  }
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return *middle;
}

}  // namespace hapticd::report
