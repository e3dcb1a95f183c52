#pragma once

#include <string>
#include <vector>

#include "client/cli/figure/axis.h"
#include "client/cli/figure/point.h"
#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// One curve of a plot on the terminal.
struct TerminalSeries {
  enum class Stroke { kLine, kDashed };
  std::string name;  ///< for the legend; empty = not listed there
  Color color = Color::kDefault;
  Stroke stroke = Stroke::kLine;
  std::vector<Point> points;
};

struct TerminalPlotFrame {
  std::string x_label;  ///< with the unit: "displacement / mm"
  std::string y_label;
  Range x;
  Range y;
  int width = 80;
  int height = 20;
};

/// Axes with ticks, legend and curves as `height` lines, each exactly `width` columns wide. Later series are
/// drawn over earlier ones. Curves are clipped to the ranges.
std::vector<std::string> draw(const TerminalPlotFrame& frame, const std::vector<TerminalSeries>& series,
                              const Terminal& terminal);

/// Two drawings side by side, as high as the higher one; `gap` blanks between.
std::vector<std::string> side_by_side(const std::vector<std::string>& left,
                                      const std::vector<std::string>& right, int gap);

}  // namespace hapticd::cli
