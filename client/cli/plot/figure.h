#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/cli/plot/terminal_plot.h"

namespace hapticd::cli {

/// One curve of a figure.
struct FigureSeries {
  enum class Stroke { kLine, kThinLine, kDashed, kDots, kPoints, kSquares, kOpenSquares };
  std::string name{};  ///< for the legend; empty = not listed there
  std::string color = "#333333";
  Stroke stroke = Stroke::kLine;
  std::vector<Point> points{};  ///< kBreak interrupts the curve
};

/// One pair of axes. Position and size are fractions of the figure, from its lower left corner.
struct FigurePanel {
  std::string title{};
  std::string x_label{};
  std::string y_label{};
  double left = 0.0;
  double bottom = 0.0;
  double width = 1.0;
  double height = 1.0;
  enum class Legend { kUpperLeft, kBelow, kAbove } legend = Legend::kUpperLeft;
  bool from_zero = false;          ///< both axes hold 0
  std::optional<Range> x_range{};  ///< else what holds all points; panels over the same time share it
  std::vector<FigureSeries> series{};
};

struct Figure {
  std::string title{};
  int width_px = 1100;
  int height_px = 560;
  std::vector<std::string> notes{};  ///< what to know of the curves, below all panels
  std::vector<FigurePanel> panels{};
};

/// The figure as a script for gnuplot, its data inside; it writes an SVG file to `svg_path`.
std::string gnuplot_script(const Figure& figure, const std::string& svg_path);

/// Throws LocalError, which names `option`, unless the path ends in .svg and its folder is there. To be asked
/// before the work whose end is the plot.
void require_svg_path(const std::string& option, const std::string& svg_path);

/// Has gnuplot draw the figure. Throws LocalError when gnuplot is not installed or failed.
void write_svg(const Figure& figure, const std::string& svg_path);

/// Thins points evenly, to at most about `max_points`; breaks are kept.
std::vector<Point> thinned(const std::vector<Point>& points, std::size_t max_points);

/// Colours that are distinguished also by the colour-blind (Okabe and Ito), for the n-th series.
std::string palette(std::size_t index);

}  // namespace hapticd::cli
