#include "client/cli/plot/svg_file.h"

#include <filesystem>

#include "client/cli/figure/gnuplot.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {

void require_svg_path(const std::string& option, const std::string& svg_path) {
  const std::filesystem::path path(svg_path);
  if (path.extension() != ".svg") {
    throw LocalError("plots are drawn as SVG only", option, svg_path, "a name that ends in .svg",
                     "convert it afterwards, e.g. with rsvg-convert");
  }
  std::error_code ignored;
  const auto folder = path.parent_path();
  if (folder.empty() || std::filesystem::is_directory(folder, ignored)) return;
  throw LocalError("cannot write the plot", option, svg_path, "a file in a folder that is there",
                   "make the folder, or see its rights");
}

void write_svg(const Figure& figure, const std::string& svg_path) {
  const auto problem = draw_svg(figure, svg_path);
  if (problem) throw LocalError(problem->what, svg_path, "", "", problem->remedy);
}

}  // namespace hapticd::cli
