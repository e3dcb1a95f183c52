#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace hapticd::calibration {

/// Median of the length of three independent normal numbers with a deviation of 1.
inline constexpr double kMedianOfThree = 1.5382;

/// Median: the upper one of two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace hapticd::calibration
