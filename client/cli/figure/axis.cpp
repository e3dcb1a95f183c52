#include "client/cli/figure/axis.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace hapticd::cli {
namespace {

/// The round number before a round one.
double round_before(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step) + 1e-9));
  const double leading = step / power;
  return leading > 4.0 ? 2.0 * power : leading > 1.5 ? power : 0.5 * power;
}

/// Smallest round number not below `value`.
double round_up(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  // The tolerance keeps 2.0000000001 from becoming 5.
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= value * (1.0 - 1e-9)) return step * power;
  }
  return 10.0 * power;
}

}  // namespace

std::vector<Tick> ticks(const Range& range, int max_count) {
  const double extent = range.high - range.low;
  if (!(extent > 0.0) || !std::isfinite(extent) || max_count < 2) return {};
  double step = round_up(extent / (max_count - 1));
  // A single tick does not make a scale.
  const auto count = [&] {
    return std::floor(range.high / step + 1e-6) - std::ceil(range.low / step - 1e-6) + 1.0;
  };
  constexpr int kMaxTries = 4;
  for (int i = 0; i < kMaxTries && count() < 2.0; ++i) step = round_before(step);
  const int decimals = std::clamp(static_cast<int>(-std::floor(std::log10(step) + 1e-9)), 0, 9);
  std::vector<Tick> result;
  const double slack = 1e-6 * step;
  // Far from zero, numbers may be too coarse for the step: then the next multiple is the same one.
  const auto max_size = static_cast<std::size_t>(max_count) + kMaxTries;
  for (double multiple = std::ceil((range.low - slack) / step);
       multiple * step <= range.high + slack && result.size() < max_size; ++multiple) {
    // Adding zero turns -0 into 0.
    const double value = multiple * step + 0.0;
    result.push_back({value, fmt::format("{:.{}f}", value, decimals)});
  }
  return result;
}

Range rounded(const Range& range) {
  if (!std::isfinite(range.low) || !std::isfinite(range.high)) return {};
  const double extent = range.high - range.low;
  if (!(extent > 0.0)) return {range.low - 0.5, range.low + 0.5};
  const double step = round_up(extent / 8.0);
  return {std::floor(range.low / step + 1e-9) * step, std::ceil(range.high / step - 1e-9) * step};
}

Range united(const Range& a, const Range& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

}  // namespace hapticd::cli
