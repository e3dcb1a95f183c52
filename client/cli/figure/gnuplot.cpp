#include "client/cli/figure/gnuplot.h"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "client/cli/figure/axis.h"
#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {
namespace {

/// Text of gnuplot in single quotes: in double ones gnuplot runs what is between two backquotes as a command
/// of the shell, and titles come from the daemon.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : printable(text)) result += c == '\'' ? "''" : std::string(1, c);
  return result + "'";
}

/// Number of a mark in gnuplot's svg terminal.
int mark_number(FigureSeries::Mark mark, std::size_t index) {
  constexpr std::array<int, 6> kOfColor{7, 5, 9, 11, 13, 6};
  switch (mark) {
    case FigureSeries::Mark::kDisc:
      return 7;
    case FigureSeries::Mark::kSquare:
      return 5;
    case FigureSeries::Mark::kOpenSquare:
      return 4;
    case FigureSeries::Mark::kTriangle:
      return 9;
    case FigureSeries::Mark::kOpenCircle:
      return 6;
    case FigureSeries::Mark::kNone:
    case FigureSeries::Mark::kOfColor:
      break;
  }
  return kOfColor[index % kOfColor.size()];
}

const char* line_style(FigureSeries::Line line) {
  switch (line) {
    case FigureSeries::Line::kThin:
      return "lw 1.3";
    case FigureSeries::Line::kDashed:
      return "lw 1.5 dt (8,6)";
    case FigureSeries::Line::kDots:
      return "lw 1 dt (1,4)";
    case FigureSeries::Line::kSolid:
    case FigureSeries::Line::kNone:
      break;
  }
  return "lw 2";
}

/// `index`: of the curve, for what the series leaves open.
std::string style(const FigureSeries& series, std::size_t index) {
  const bool has_line = series.line != FigureSeries::Line::kNone;
  const bool has_marks = series.mark != FigureSeries::Mark::kNone;
  std::string text = has_line && has_marks ? "with linespoints" : has_line ? "with lines" : "with points";
  if (has_line) text += std::string(" ") + line_style(series.line);
  std::size_t color = index;
  for (std::size_t i = 0; i < 8; ++i) {
    if (series.color == palette(i)) color = i;
  }
  if (has_marks) text += fmt::format(" pt {} ps {:g}", mark_number(series.mark, color), series.mark_size);
  return text + " lc rgb \"" + (series.color.empty() ? palette(index) : series.color) + '"';
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

/// Numbers of an axis as gnuplot chooses them, within the given ends.
std::string own_range(char letter, const FigureAxis& axis) {
  const auto end = [](const std::optional<double>& value) {
    return value ? fmt::format("{:.9g}", *value) : std::string("*");
  };
  std::string text = fmt::format("set {}range [{}:{}]\n", letter, end(axis.minimum), end(axis.maximum));
  if (axis.logarithmic) text += fmt::format("set logscale {0}\nset format {0} '%g'\n", letter);
  return text;
}

/// Names in place of numbers.
std::string named_range(char letter, const FigureAxis& axis) {
  const double last = static_cast<double>(axis.categories.size()) - 0.5;
  std::string names;
  for (std::size_t i = 0; i < axis.categories.size(); ++i) {
    names += fmt::format("{}{} {}", i > 0 ? ", " : "", quoted(axis.categories[i]), i);
  }
  return fmt::format("set {0}range [{1:.9g}:{2:.9g}]\nset {0}tics ({3}){4}\n", letter,
                     axis.minimum.value_or(-0.5), axis.maximum.value_or(last), names,
                     letter == 'x' ? " rotate by 25 right" : "");
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
  for (const FigureReference& reference : panel.references) {
    Range& across = reference.axis == FigureReference::Axis::kX ? x : y;
    across = united(across, {reference.value, reference.value});
  }
  if (panel.from_zero || !(x.high > x.low)) x = rounded(x);
  x = {panel.x.minimum.value_or(x.low), panel.x.maximum.value_or(x.high)};
  y = rounded({panel.y.minimum.value_or(y.low), panel.y.maximum.value_or(y.high)});
  y = {panel.y.minimum.value_or(y.low), panel.y.maximum.value_or(y.high)};
  std::string text = "unset logscale\nset format '%h'\nset xtics autofreq norotate\nset ytics autofreq\n";
  if (!panel.x.categories.empty()) {
    text += named_range('x', panel.x);
  } else if (panel.x.logarithmic) {
    text += own_range('x', panel.x);
  } else {
    text += fmt::format("set xrange [{:.9g}:{:.9g}]\n", x.low, x.high);
  }
  if (!panel.y.categories.empty()) {
    text += named_range('y', panel.y);
  } else if (panel.y.logarithmic) {
    text += own_range('y', panel.y);
  } else {
    text += fmt::format("set yrange [{:.9g}:{:.9g}]\n", y.low, y.high) + vertical_labels(y, height_px);
  }
  return text;
}

constexpr std::size_t kFirstReference = 1000;  // number of its label; those before are of notes

/// Thin lines across the panel, labelled; numbered, so that the next panel can take them away.
std::string reference_lines(const std::vector<FigureReference>& references) {
  std::string script = "unset arrow\n";
  for (std::size_t i = 0; i < references.size(); ++i) {
    const bool is_across = references[i].axis == FigureReference::Axis::kY;
    const std::string at = fmt::format("first {:.9g}", references[i].value);
    script += fmt::format("set arrow {} from {} to {} nohead back dt (8,5) lc rgb \"#777777\"\n", i + 1,
                          is_across ? "graph 0, " + at : at + ", graph 0",
                          is_across ? "graph 1, " + at : at + ", graph 1");
    if (references[i].label.empty()) continue;
    script += fmt::format(
        "set label {} {} at {} tc rgb \"#555555\" front\n", kFirstReference + i, quoted(references[i].label),
        is_across ? "graph 0.99, " + at + " right offset 0,0.5" : at + ", graph 0.97 left offset 0.6,0");
  }
  return script;
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
    case FigurePanel::Legend::kRight:
      return "set key outside right top vertical" + common + "maxcols auto\n";
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
        quoted(panel.title), quoted(panel.x.title()), quoted(panel.y.title()));
    script += has_names(panel) ? legend(panel.legend) : "unset key\n";
    script += axis_ranges(panel, panel.height * (1.0 - notes) * figure.height_px);
    script += reference_lines(panel.references);
    std::string plots;
    for (std::size_t s = 0; s < panel.series.size(); ++s) {
      const FigureSeries& series = panel.series[s];
      if (series.points.empty()) continue;
      plots += (plots.empty() ? "plot " : ", \\\n     ") + block_name(p, s) + " using 1:2 " +
               (series.name.empty() ? "notitle" : "title " + quoted(series.name)) + " " + style(series, s);
    }
    script += plots + "\n";
    if ((p == 0 && !lines.empty()) || !panel.references.empty()) script += "unset label\n";
  }
  return script + "unset multiplot\nunset output\n";
}

std::optional<GnuplotProblem> draw_svg(const Figure& figure, const std::string& svg_path) {
  if (!installed("gnuplot"))
    return GnuplotProblem{"gnuplot is not installed, and it draws the plots", "apt-get install gnuplot-nox"};
  const std::string script = gnuplot_script(figure, svg_path);
  // A gnuplot that ends early must not end this program.
  const auto before = std::signal(SIGPIPE, SIG_IGN);
  // Under another locale gnuplot complains of every sign that is not ASCII.
  std::FILE* pipe = popen("LC_ALL=C.UTF-8 gnuplot -", "w");
  if (pipe == nullptr) return GnuplotProblem{"gnuplot could not be started", ""};
  const bool sent = std::fwrite(script.data(), 1, script.size(), pipe) == script.size();
  const int status = pclose(pipe);
  std::signal(SIGPIPE, before);
  if (sent && status == 0) return std::nullopt;
  return GnuplotProblem{"gnuplot could not draw the plot; its own complaint is above",
                        "is the folder there, and may it be written to?"};
}

}  // namespace hapticd::cli
