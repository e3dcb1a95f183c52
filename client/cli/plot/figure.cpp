#include "client/cli/plot/figure.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <sstream>
#include <utility>

#include "client/cli/session/session.h"
#include "client/cli/session/terminal.h"

namespace hapticd::cli {
namespace {

/// Text of gnuplot in single quotes: in double ones gnuplot runs what is between two backquotes as a command
/// of the shell, and titles come from the daemon.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : printable(text)) result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

std::string style(const FigureSeries& series) {
  switch (series.stroke) {
    case FigureSeries::Stroke::kLine:
      return fmt::format("with lines lw 2 lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kThinLine:
      return fmt::format("with lines lw 1.3 lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kDashed:
      return fmt::format("with lines lw 1.5 dt (8,6) lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kDots:
      return fmt::format("with lines lw 1 dt (1,4) lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kPoints:
      return fmt::format("with points pt 7 ps 0.7 lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kSquares:
      return fmt::format("with points pt 5 ps 1.6 lc rgb \"{}\"", series.color);
    case FigureSeries::Stroke::kOpenSquares:
      return fmt::format("with points pt 4 ps 1.6 lc rgb \"{}\"", series.color);
  }
  return "with lines";
}

void append_data(std::string& script, const std::string& block, const std::vector<Point>& points) {
  script += block + " << EOD\n";
  for (const Point& point : points) {
    // An empty line interrupts a curve.
    script += std::isfinite(point.x) && std::isfinite(point.y)
                  ? fmt::format("{:.6g} {:.6g}\n", point.x, point.y)
                  : "\n";
  }
  script += "EOD\n";
}

/// Labels of the vertical axis as far apart as they need; gnuplot's own lie on each other in a low panel.
std::string vertical_labels(const Range& y, double height_px) {
  constexpr double kPxALabel = 45.0;
  constexpr int kMaxLabels = 9;
  std::string labels;
  for (const Tick& tick : ticks(y, std::clamp(static_cast<int>(height_px / kPxALabel), 3, kMaxLabels))) {
    labels += fmt::format("{}\"{}\" {:.9g}", labels.empty() ? "" : ", ", tick.label, tick.value);
  }
  return "set ytics (" + labels + ")\n";
}

/// Ranges that hold all points; gnuplot's own would complain of a quantity that never changed.
std::string axis_ranges(const FigurePanel& panel, double height_px) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  Range x{kNone, -kNone};
  Range y{kNone, -kNone};
  for (const auto& series : panel.series) {
    for (const Point& point : series.points) {
      if (!std::isfinite(point.x) || !std::isfinite(point.y)) continue;
      x = united(x, {point.x, point.x});
      y = united(y, {point.y, point.y});
    }
  }
  if (panel.from_zero) {
    x.low = std::min(x.low, 0.0);
    y.low = std::min(y.low, 0.0);
  }
  y = rounded(y);
  if (panel.x_range) {
    x = *panel.x_range;
  } else if (panel.from_zero || !(x.high > x.low))
    x = rounded(x);
  return fmt::format("set xrange [{:.9g}:{:.9g}]\nset yrange [{:.9g}:{:.9g}]\n", x.low, x.high, y.low,
                     y.high) +
         vertical_labels(y, height_px);
}

bool has_names(const FigurePanel& panel) {
  return std::any_of(panel.series.begin(), panel.series.end(),
                     [](const FigureSeries& series) { return !series.name.empty(); });
}

std::string legend(FigurePanel::Legend place) {
  const std::string common = " Left reverse samplen 2 spacing 1.1 ";
  switch (place) {
    case FigurePanel::Legend::kUpperLeft:
      return "set key inside top left vertical" + common + "maxcols auto\n";
    case FigurePanel::Legend::kAbove:
      return "set key above" + common + "maxcols auto\n";
    case FigurePanel::Legend::kBelow:
      return "set key below" + common + "height 1 maxcols 2\nset xlabel offset 0,0.6\n";
  }
  return "";
}

constexpr double kNoteLinePx = 18.0;
constexpr double kNoteLetterPx = 8.6;  // of the font of the notes, generously

/// The notes, broken into lines that the figure has room for.
std::vector<std::string> note_lines(const Figure& figure) {
  std::vector<std::string> lines;
  for (const std::string& note : figure.notes) {
    for (std::string& line : wrapped(note, static_cast<std::size_t>(figure.width_px / kNoteLetterPx))) {
      lines.push_back(std::move(line));
    }
  }
  return lines;
}

/// Notes lines in the figure's lower left corner; for the panel that is plotted next.
std::string note_labels(const std::vector<std::string>& lines, int height_px) {
  std::string script;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double from_below = static_cast<double>(lines.size() - i) - 0.4;
    script += fmt::format("set label {} {} at screen 0.012,{:.4f} left font \",12\" tc rgb \"#333333\"\n",
                          i + 1, quoted(lines[i]), from_below * kNoteLinePx / height_px);
  }
  return script;
}

std::string block_name(std::size_t panel, std::size_t series) {
  return fmt::format("$data_{}_{}", panel, series);
}

bool installed(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/bin:/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access(folder.append("/").append(program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

}  // namespace

std::string gnuplot_script(const Figure& figure, const std::string& svg_path) {
  std::string script = fmt::format(
      "set encoding utf8\n"
      "set terminal svg size {},{} font \"sans-serif,13\" background \"#ffffff\" noenhanced\n"
      "set output {}\n",
      figure.width_px, figure.height_px, quoted(svg_path));
  for (std::size_t p = 0; p < figure.panels.size(); ++p) {
    for (std::size_t s = 0; s < figure.panels[p].series.size(); ++s) {
      append_data(script, block_name(p, s), figure.panels[p].series[s].points);
    }
  }
  script += fmt::format(
      "set border 3 lc rgb \"#555555\"\n"
      "set tics nomirror out scale 0.6\n"
      "set grid lc rgb \"#e4e4e4\" lt 1 lw 1\n"
      "set multiplot title {} font \",15\"\n",
      quoted(figure.title));
  const std::vector<std::string> lines = note_lines(figure);
  const double notes = static_cast<double>(lines.size()) * kNoteLinePx / figure.height_px;
  script += note_labels(lines, figure.height_px);
  for (std::size_t p = 0; p < figure.panels.size(); ++p) {
    const FigurePanel& panel = figure.panels[p];
    script += fmt::format(
        "set origin {},{}\nset size {},{}\nset title {}\nset xlabel {} offset 0,0\nset ylabel {}\n",
        panel.left, notes + panel.bottom * (1.0 - notes), panel.width, panel.height * (1.0 - notes),
        quoted(panel.title), quoted(panel.x_label), quoted(panel.y_label));
    script += has_names(panel) ? legend(panel.legend) : "unset key\n";
    script += axis_ranges(panel, panel.height * (1.0 - notes) * figure.height_px);
    std::string plots;
    for (std::size_t s = 0; s < panel.series.size(); ++s) {
      const FigureSeries& series = panel.series[s];
      if (series.points.empty()) continue;
      plots += (plots.empty() ? "plot " : ", \\\n     ") + block_name(p, s) + " using 1:2 " +
               (series.name.empty() ? "notitle" : "title " + quoted(series.name)) + " " + style(series);
    }
    script += plots + "\n";
    if (p == 0 && !lines.empty()) script += "unset label\n";
  }
  return script + "unset multiplot\nunset output\n";
}

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
  if (!installed("gnuplot")) {
    throw LocalError("gnuplot is not installed, and it draws the plots", svg_path, "", "",
                     "apt-get install gnuplot-nox");
  }
  const std::string script = gnuplot_script(figure, svg_path);
  // A gnuplot that ends early must not end this program.
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  // Under another locale gnuplot complains of every sign that is not ASCII.
  std::FILE* pipe = popen("LC_ALL=C.UTF-8 gnuplot -", "w");
  if (pipe == nullptr) throw LocalError("gnuplot could not be started", svg_path);
  const bool sent = std::fwrite(script.data(), 1, script.size(), pipe) == script.size();
  const int status = pclose(pipe);
  std::signal(SIGPIPE, before);
  if (!sent || status != 0) {
    throw LocalError("gnuplot could not draw the plot; its own complaint is above", svg_path, "", "",
                     "is the folder there, and may it be written to?");
  }
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
  static constexpr std::array<const char*, 6> kColors{"#0072b2", "#d55e00", "#009e73",
                                                      "#cc79a7", "#56b4e9", "#e69f00"};
  return kColors[index % kColors.size()];
}

}  // namespace hapticd::cli
