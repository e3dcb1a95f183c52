#pragma once

#include <algorithm>
#include <cmath>

namespace hapticd::sim {

/// Place between bounds at which something increasing becomes zero: Newton's method, and halving where it
/// would leave them. To 1e-11 (mm), in 30 evaluations at most; `steepness` is asked right after `value` at
/// the same place.
template <class Value, class Steepness>
double monotone_root(const Value& value, const Steepness& steepness, double start, double low, double high) {
  constexpr double kTolerance = 1e-11;
  double y = std::clamp(start, low, high);
  for (int iteration = 0; iteration < 30; ++iteration) {
    const double residual = value(y);
    (residual > 0.0 ? high : low) = y;
    double next = y - residual / steepness(y);
    if (!(next >= low && next <= high)) next = 0.5 * (low + high);
    if (std::abs(next - y) < kTolerance) return next;
    y = next;
  }
  return y;
}

}  // namespace hapticd::sim
