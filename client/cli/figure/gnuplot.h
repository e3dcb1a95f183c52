#pragma once

#include <optional>
#include <string>

#include "client/cli/figure/figure.h"

namespace hapticd::cli {

/// The figure as a script for gnuplot, its data inside; it writes an SVG file to `svg_path`.
std::string gnuplot_script(const Figure& figure, const std::string& svg_path);

/// Why a figure was not drawn.
struct GnuplotProblem {
  std::string what;
  std::string remedy;
};

/// Has gnuplot draw the figure. Returns why it could not; what gnuplot itself complains of is on standard
/// error.
std::optional<GnuplotProblem> draw_svg(const Figure& figure, const std::string& svg_path);

}  // namespace hapticd::cli
