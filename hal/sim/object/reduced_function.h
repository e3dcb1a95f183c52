#pragma once

#include <array>
#include <cstddef>

namespace hapticd::sim {

/// A smooth function of the depth d of a tip below a sphere and of its angle a from an axis,
///   Σ c[k][m] d^p[k] · t^m · e,
/// either over the whole body (t = 2 sin² a, e = 1) or around the axis only (t = (a / scale)², e = exp(-t)).
/// Beyond the depth it was made for it goes on as a parabola.
struct ReducedFunction {
  static constexpr std::size_t kPowers = 4;
  static constexpr std::size_t kTerms = 4;

  std::array<double, kPowers> powers{};
  double scale_rad = 0.0;  ///< 0 = over the whole body
  double last_depth_mm = 18.0;
  std::array<std::array<double, kTerms>, kPowers> factors{};

  /// Value and first derivatives, and the second one by depth.
  struct Value {
    double value = 0.0;
    double by_depth = 0.0;
    double by_depth_twice = 0.0;
    double by_angle = 0.0;
    double by_depth_and_angle = 0.0;
  };
  Value at(double depth_mm, double angle_rad) const noexcept;
};

}  // namespace hapticd::sim
