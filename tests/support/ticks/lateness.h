#pragma once

#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <utility>
#include <vector>

namespace hapticd::test {

/// Lateness of each of so many ticks of a millisecond: `pauses` are {every so many ticks, µs}. Those
/// that could not be in time after a pause are late, too.
inline std::vector<double> lateness_us(std::size_t ticks,
                                       std::initializer_list<std::pair<std::size_t, double>> pauses) {
  std::vector<double> late_us(ticks, 0.0);
  for (const auto& [every, pause_us] : pauses) {
    for (std::size_t i = every - 1; i < ticks; i += every) late_us[i] = pause_us;
  }
  for (std::size_t i = 1; i < ticks; ++i) late_us[i] = std::max(late_us[i], late_us[i - 1] - 1'000.0);
  return late_us;
}

}  // namespace hapticd::test
