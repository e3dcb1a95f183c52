#pragma once

#include <string>

#include "client/cli/figure/figure.h"

namespace hapticd::cli {

/// Throws LocalError, which names `option`, unless the path ends in .svg and its folder is there. To be asked
/// before the work whose end is the plot.
void require_svg_path(const std::string& option, const std::string& svg_path);

/// Has gnuplot draw the figure. Throws LocalError when gnuplot is not installed or failed.
void write_svg(const Figure& figure, const std::string& svg_path);

}  // namespace hapticd::cli
