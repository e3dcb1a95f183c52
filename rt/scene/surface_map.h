#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace hapticd::rt {

/// A scanned surface: heights over a grid of x and y, rig frame. Row after row, x running along a row.
struct SurfaceMapParameters {
  static constexpr std::size_t kMinSide = 2;
  static constexpr std::size_t kMaxSide = 64;

  std::array<double, 2> from_mm{};  ///< x and y of the first height
  double step_mm = 5.0;             ///< of the grid, along x and y
  std::uint32_t columns = 0;        ///< heights in a row
  std::vector<double> heights_mm{};

  std::size_t rows() const noexcept { return columns == 0 ? 0 : heights_mm.size() / columns; }
  bool operator==(const SurfaceMapParameters&) const = default;
};

/// Height and slope anywhere: cubic convolution (Keys 1981, a = -1/2) through the heights; exact for
/// quadratics inside, error of third order in the step, slope continuous. Beyond the grid the surface goes on
/// level. Bounded work, no allocation after the constructor.
class SurfaceMap {
 public:
  struct Point {
    double height_mm = 0.0;
    double slope_x = 0.0;  ///< dz/dx
    double slope_y = 0.0;
  };

  /// `parameters` are complete: kMinSide … kMaxSide rows and columns.
  explicit SurfaceMap(SurfaceMapParameters parameters) : map_(std::move(parameters)), rows_(map_.rows()) {}

  Point at(double x_mm, double y_mm) const noexcept {
    const Cell x = cell((x_mm - map_.from_mm[0]) / map_.step_mm, map_.columns);
    const Cell y = cell((y_mm - map_.from_mm[1]) / map_.step_mm, rows_);
    Point point;
    for (int j = 0; j < 4; ++j) {
      double row = 0.0;
      double row_slope = 0.0;
      for (int i = 0; i < 4; ++i) {
        const double height_mm = height(x.index + i - 1, y.index + j - 1);
        row += x.weight[static_cast<std::size_t>(i)] * height_mm;
        row_slope += x.slope[static_cast<std::size_t>(i)] * height_mm;
      }
      point.height_mm += y.weight[static_cast<std::size_t>(j)] * row;
      point.slope_x += y.weight[static_cast<std::size_t>(j)] * row_slope;
      point.slope_y += y.slope[static_cast<std::size_t>(j)] * row;
    }
    point.slope_x /= map_.step_mm;
    point.slope_y /= map_.step_mm;
    return point;
  }

 private:
  struct Cell {
    std::ptrdiff_t index = 0;
    std::array<double, 4> weight{};
    std::array<double, 4> slope{};  ///< of the weights, per step
  };

  static Cell cell(double place, std::size_t count) noexcept {
    const double last = static_cast<double>(count - 1);
    const bool is_inside = place > 0.0 && place < last;
    const double inside = std::clamp(place, 0.0, last);
    Cell cell;
    cell.index = std::min(static_cast<std::ptrdiff_t>(inside), static_cast<std::ptrdiff_t>(count) - 2);
    const double t = inside - static_cast<double>(cell.index);
    cell.weight = {0.5 * t * (-1.0 + t * (2.0 - t)), 1.0 + 0.5 * t * t * (3.0 * t - 5.0),
                   0.5 * t * (1.0 + t * (4.0 - 3.0 * t)), 0.5 * t * t * (t - 1.0)};
    if (is_inside) {
      cell.slope = {-0.5 + t * (2.0 - 1.5 * t), t * (4.5 * t - 5.0), 0.5 + t * (4.0 - 4.5 * t),
                    t * (1.5 * t - 1.0)};
    }
    return cell;
  }

  /// Height of the grid; one step beyond it on the parabola through the last three, or the line through two.
  double height(std::ptrdiff_t column, std::ptrdiff_t row) const noexcept {
    const auto columns = static_cast<std::ptrdiff_t>(map_.columns);
    const auto rows = static_cast<std::ptrdiff_t>(rows_);
    if (column < 0) return beyond(columns, [&](std::ptrdiff_t i) { return height(i, row); });
    if (column >= columns)
      return beyond(columns, [&](std::ptrdiff_t i) { return height(columns - 1 - i, row); });
    if (row < 0) return beyond(rows, [&](std::ptrdiff_t i) { return height(column, i); });
    if (row >= rows) return beyond(rows, [&](std::ptrdiff_t i) { return height(column, rows - 1 - i); });
    return map_.heights_mm[static_cast<std::size_t>(row * columns + column)];
  }
  template <class At>
  static double beyond(std::ptrdiff_t count, At&& at) noexcept {
    return count > 2 ? 3.0 * at(0) - 3.0 * at(1) + at(2) : 2.0 * at(0) - at(1);
  }

  SurfaceMapParameters map_;
  std::size_t rows_;
};

}  // namespace hapticd::rt
