#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace hapticd::calibration {

/// Median of the length of three independent normal numbers with a deviation of 1.
inline constexpr double kMedianOfThree = 1.5382;

/// End of Tukey's biweight for three numbers together: 0.3 % of good poses lie beyond two thirds of it.
inline constexpr double kOutlierDeviations = 6.0;

/// Median: the upper one of two in the middle; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace hapticd::calibration
