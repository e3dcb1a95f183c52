#include "server/identification/session/identification.h"

#include <algorithm>
#include <utility>

namespace hapticd::identification {

Coverage::Coverage(Axis x_axis, Axis y_axis) : x(std::move(x_axis)), y(std::move(y_axis)) {
  const auto cells = static_cast<std::size_t>(x.bins * std::max(1, y.bins));
  counts.resize(cells);
  required.resize(cells);
}

std::size_t Coverage::cell_at(double at_x, double at_y) const noexcept {
  const auto bin = [](const Axis& axis, double value) {
    const double at = (value - axis.from) / (axis.to - axis.from) * axis.bins;
    return at > 0.0 ? static_cast<int>(std::min(at, axis.bins - 1.0)) : 0;
  };
  return cell(bin(x, at_x), bin(y, at_y));
}

void Coverage::update_share(double without) noexcept {
  std::size_t all = 0, met = 0;
  for (std::size_t i = 0; i < required.size(); ++i) {
    if (required[i] == 0) continue;
    ++all;
    met += has_enough(i) ? 1U : 0U;
  }
  share = all > 0 ? static_cast<double>(met) / static_cast<double>(all) : without;
}

}  // namespace hapticd::identification
