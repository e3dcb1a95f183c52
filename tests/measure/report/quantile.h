#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace hapticd::report {

/// The value below which `share` (0 … 1) of them lie, one of the values; NaN if there are none.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  const auto rank = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank), values.end());
  return values[rank];
}

}  // namespace hapticd::report
