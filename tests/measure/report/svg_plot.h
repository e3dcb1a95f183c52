#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::report {

struct PlotAxis {
  std::string label;   ///< what is measured, e.g. "displacement"
  std::string unit{};  ///< shown in brackets; empty = none
  bool logarithmic = false;
  std::optional<double> minimum{};  ///< empty = from the data
  std::optional<double> maximum{};
  std::vector<std::string> categories{};  ///< names instead of numbers, the first at 0
};

struct PlotSeries {
  enum class Style : unsigned char { kLine, kPoints, kLinePoints };
  std::string label;  ///< in the legend; empty = not in the legend
  std::vector<double> x{};
  std::vector<double> y{};  ///< a value that is not finite interrupts the line
  Style style = Style::kLine;
  std::optional<int> colour{};  ///< of the palette; series that belong together share one; empty = the next
  bool dashed = false;
  double point_size = 0.6;
  std::optional<int>
      point_type{};  ///< of gnuplot's svg terminal (5 square, 7 disc, 9 triangle …); empty = by colour

  void add(double at, double value) {
    x.push_back(at);
    y.push_back(value);
  }
};

/// A limit, a goal, someone else's value: a thin line across the plot, labelled at its end.
struct PlotReference {
  enum class Axis : unsigned char { kX, kY };
  Axis axis = Axis::kY;
  double value = 0.0;
  std::string label{};
};

struct SvgPlot {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<PlotSeries> series{};
  std::vector<PlotReference> references{};
  int width_px = 900;
  int height_px = 520;
};

/// Writes FOLDER/NAME.csv (the data: series, x, y), FOLDER/NAME.gp (a gnuplot script that draws them) and, by
/// running gnuplot, FOLDER/NAME.svg. Returns what went wrong, with the remedy, and nothing when all is well:
/// without gnuplot there is no drawing, but data and script are there. Throws std::runtime_error if the
/// folder cannot be written to, std::invalid_argument if a series' x and y differ in length.
std::optional<std::string> draw(const SvgPlot& plot, const std::filesystem::path& folder,
                                const std::string& name);

}  // namespace hapticd::report
