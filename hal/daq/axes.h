#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "hal/samples.h"

namespace hapticd::daq {

/// Which way the sensor's axes point in the tool: component i of the tool's is ± one of the sensor's, each
/// used once. Force and torque are mapped alike.
struct Axes {
  std::array<int, 3> source{0, 1, 2};
  std::array<double, 3> sign{1.0, 1.0, 1.0};

  hal::Vector3 apply(const hal::Vector3& v) const noexcept {
    const std::array<double, 3> from{v.x, v.y, v.z};
    const auto component = [&](std::size_t i) { return sign[i] * from[static_cast<std::size_t>(source[i])]; };
    return {component(0), component(1), component(2)};
  }
};

/// Reads e.g. "+x -y -z"; nothing when it is not that.
inline std::optional<Axes> parse_axes(std::string_view text) {
  Axes axes;
  std::array<bool, 3> used{};
  std::size_t found = 0;
  double sign = 1.0;
  bool signed_now = false;
  for (const char c : text) {
    if (c == ' ' || c == ',') {
      if (signed_now) return std::nullopt;
      continue;
    }
    if (c == '+' || c == '-') {
      if (signed_now) return std::nullopt;
      signed_now = true;
      sign = c == '-' ? -1.0 : 1.0;
      continue;
    }
    if (c < 'x' || c > 'z' || found == 3) return std::nullopt;
    const int axis = c - 'x';
    if (used[static_cast<std::size_t>(axis)]) return std::nullopt;
    used[static_cast<std::size_t>(axis)] = true;
    axes.source[found] = axis;
    axes.sign[found] = sign;
    ++found;
    sign = 1.0;
    signed_now = false;
  }
  if (found != 3 || signed_now) return std::nullopt;
  return axes;
}

}  // namespace hapticd::daq
