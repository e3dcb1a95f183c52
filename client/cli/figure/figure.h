#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/figure/point.h"

namespace hapticd::cli {

/// One curve of a figure.
struct FigureSeries {
  enum class Line { kSolid, kThin, kDashed, kDots, kNone };
  enum class Mark { kNone, kDisc, kSquare, kOpenSquare, kTriangle, kOpenCircle, kOfColor };

  std::string name{};   ///< for the legend; empty = not listed there
  std::string color{};  ///< "#rrggbb"; empty = that of palette() for its place among the curves
  Line line = Line::kSolid;
  std::vector<Point> points{};  ///< kBreak interrupts the curve
  Mark mark = Mark::kNone;      ///< at each point; kOfColor: another one for each colour of palette()
  double mark_size = 0.7;

  void add(double x, double y) { points.push_back({x, y}); }
  /// Shows the points by marks without a line between them.
  void marks_only(double size = 0.7) {
    line = Line::kNone;
    mark = Mark::kOfColor;
    mark_size = size;
  }
};

struct FigureAxis {
  std::string label{};  ///< what is measured: "displacement"
  std::string unit{};   ///< shown after the label; empty or "1" = none
  bool logarithmic = false;
  std::optional<double> minimum{};  ///< empty = from the data; panels over the same time share both ends
  std::optional<double> maximum{};
  std::vector<std::string> categories{};  ///< names in place of numbers, the first at 0

  /// "displacement / mm", "stiffness / (N/mm)".
  std::string title() const;
};

/// A limit, a goal, someone else's value: a thin line across a panel, labelled at its end.
struct FigureReference {
  enum class Axis { kX, kY };
  Axis axis = Axis::kY;
  double value = 0.0;
  std::string label{};
};

/// One pair of axes. Position and size are fractions of the figure, from its lower left corner.
struct FigurePanel {
  std::string title{};
  FigureAxis x{};
  FigureAxis y{};
  double left = 0.0;
  double bottom = 0.0;
  double width = 1.0;
  double height = 1.0;
  enum class Legend { kUpperLeft, kBelow, kAbove, kRight } legend = Legend::kUpperLeft;
  bool from_zero = false;  ///< both axes hold 0
  std::vector<FigureSeries> series{};
  std::vector<FigureReference> references{};
};

/// A drawing of some panels. hapticctl makes them of recordings, incidents, identifications and
/// demonstrations; studies and benchmarks of what they measure. gnuplot.h draws it.
struct Figure {
  std::string title{};
  int width_px = 1100;
  int height_px = 560;
  std::vector<std::string> notes{};  ///< what to know of the curves, below all panels
  std::vector<FigurePanel> panels{};
};

/// Points at x[i], y[i]; the longer one's rest is left out.
std::vector<Point> points_of(const std::vector<double>& x, const std::vector<double>& y);

/// Thins points evenly, to at most about `max_points`; breaks are kept.
std::vector<Point> thinned(const std::vector<Point>& points, std::size_t max_points);

/// Eight colours that are distinguished also by the colour-blind and in grey (after Okabe and Ito), for the
/// n-th curve.
std::string palette(std::size_t index);

}  // namespace hapticd::cli
