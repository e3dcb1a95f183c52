#pragma once

#include <limits>

namespace hapticd::cli {

/// A point of a curve, in the units of its axes.
struct Point {
  double x = 0.0;
  double y = 0.0;
};

/// Break between points: interrupts a curve.
inline constexpr Point kBreak{std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::quiet_NaN()};

}  // namespace hapticd::cli
