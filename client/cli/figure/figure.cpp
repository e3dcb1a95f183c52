#include "client/cli/figure/figure.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace hapticd::cli {

std::string FigureAxis::title() const {
  if (unit.empty() || unit == "1") return label;
  const bool is_compound = unit.find_first_of("/ ") != std::string::npos;
  return label + " / " + (is_compound ? "(" + unit + ")" : unit);
}

std::vector<Point> points_of(const std::vector<double>& x, const std::vector<double>& y) {
  std::vector<Point> points(std::min(x.size(), y.size()));
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = {x[i], y[i]};
  return points;
}

std::vector<Point> thinned(const std::vector<Point>& points, std::size_t max_points) {
  const std::size_t stride = max_points == 0 ? 1 : points.size() / max_points + 1;
  std::vector<Point> result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % stride == 0 || !std::isfinite(points[i].x) || i + 1 == points.size()) result.push_back(points[i]);
  }
  return result;
}

std::string palette(std::size_t index) {
  static constexpr std::array<const char*, 8> kColors{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                                      "#56b4e9", "#e69f00", "#5a4fcf", "#4d4d4d"};
  return kColors[index % kColors.size()];
}

}  // namespace hapticd::cli
