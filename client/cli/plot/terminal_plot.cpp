#include "client/cli/plot/terminal_plot.h"

#include <algorithm>
#include <cmath>

#include "client/cli/plot/braille_canvas.h"

namespace hapticd::cli {
namespace {

constexpr int kMinimumCanvasColumns = 10;
constexpr int kDashDots = 4;

/// The characters axes are made of.
struct AxisGlyphs {
  std::string vertical, horizontal, y_tick, x_tick, corner, line_key, dash_key;
};

AxisGlyphs glyphs(bool unicode) {
  if (unicode) return {"│", "─", "┤", "┬", "└", "━━", "╍╍"};
  return {"|", "-", "+", "+", "+", "==", "--"};
}

/// Part of the segment inside the ranges (Liang-Barsky); false when none is.
bool clip(Point& a, Point& b, const Range& x, const Range& y) {
  double from = 0.0;
  double to = 1.0;
  const double dx = b.x - a.x;
  const double dy = b.y - a.y;
  const auto edge = [&](double direction, double distance) {
    if (direction == 0.0) return distance >= 0.0;
    const double at = distance / direction;
    if (direction < 0.0) {
      from = std::max(from, at);
    } else {
      to = std::min(to, at);
    }
    return from <= to;
  };
  if (!edge(-dx, a.x - x.low) || !edge(dx, x.high - a.x) || !edge(-dy, a.y - y.low) ||
      !edge(dy, y.high - a.y)) {
    return false;
  }
  const Point start = a;
  a = {start.x + from * dx, start.y + from * dy};
  b = {start.x + to * dx, start.y + to * dy};
  return true;
}

/// Position of `value` among `count` cells or dots.
int place(double value, const Range& range, int count) {
  return static_cast<int>(std::lround((value - range.low) / (range.high - range.low) * (count - 1)));
}

void draw_series(BrailleCanvas& canvas, const TerminalSeries& series, const TerminalPlotFrame& frame) {
  const int dash = series.stroke == TerminalSeries::Stroke::kDashed ? kDashDots : 0;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    Point a = series.points[i > 0 ? i - 1 : 0];
    Point b = series.points[i];
    if (!std::isfinite(b.x) || !std::isfinite(b.y)) continue;
    if (!std::isfinite(a.x) || !std::isfinite(a.y)) a = b;
    if (!clip(a, b, frame.x, frame.y)) continue;
    const int bottom = canvas.dot_rows() - 1;
    canvas.line(place(a.x, frame.x, canvas.dot_columns()), bottom - place(a.y, frame.y, canvas.dot_rows()),
                place(b.x, frame.x, canvas.dot_columns()), bottom - place(b.y, frame.y, canvas.dot_rows()),
                series.color, dash);
  }
}

/// "force / N        ━━ hand  ╍╍ target", the legend at the right, on a second line where one is too short
/// and the plot is high enough; entries that fit on neither are left out.
std::vector<std::string> heading(const TerminalPlotFrame& frame, const std::vector<TerminalSeries>& series,
                                 const Terminal& terminal, const AxisGlyphs& glyph) {
  constexpr int kHeightOfTwoLines = 10;
  const auto width = static_cast<std::size_t>(frame.width);
  const std::size_t most = frame.height >= kHeightOfTwoLines ? 2 : 1;
  std::vector<std::string> legends(1);
  for (const auto& entry : series) {
    if (entry.name.empty()) continue;
    const auto& key = entry.stroke == TerminalSeries::Stroke::kDashed ? glyph.dash_key : glyph.line_key;
    const std::string item = "  " + terminal.paint(entry.color, key) + " " + entry.name;
    const std::size_t beside = legends.size() == 1 ? display_width(frame.y_label) + 1 : 0;
    if (beside + display_width(legends.back()) + display_width(item) <= width) {
      legends.back() += item;
    } else if (legends.size() < most && display_width(item) <= width) {
      legends.push_back(item);
    } else {
      break;
    }
  }
  for (std::string& line : legends) {
    const std::size_t left = width - std::min(width, display_width(line));
    line = padded(&line == &legends.front() ? frame.y_label : "", left) + line;
  }
  return legends;
}

/// Labels of the horizontal axis under their ticks, its name at the right end.
std::string foot(const TerminalPlotFrame& frame, const std::vector<Tick>& x_ticks, std::size_t margin,
                 int columns) {
  std::string line(static_cast<std::size_t>(frame.width), ' ');
  const std::size_t name_width = std::min(display_width(frame.x_label), line.size());
  const std::size_t name_begin = line.size() - name_width;
  std::size_t next_free = 0;
  for (const Tick& tick : x_ticks) {
    const std::size_t middle = margin + static_cast<std::size_t>(place(tick.value, frame.x, columns));
    const std::size_t begin = middle >= tick.label.size() / 2 ? middle - tick.label.size() / 2 : 0;
    if (begin < next_free || begin + tick.label.size() + 2 > name_begin) continue;
    line.replace(begin, tick.label.size(), tick.label);
    next_free = begin + tick.label.size() + 1;
  }
  return line.substr(0, name_begin) + padded(frame.x_label, name_width);
}

}  // namespace

std::vector<std::string> draw(const TerminalPlotFrame& frame, const std::vector<TerminalSeries>& series,
                              const Terminal& terminal) {
  const AxisGlyphs glyph = glyphs(terminal.unicode);
  std::vector<std::string> lines = heading(frame, series, terminal, glyph);
  const int rows = std::max(frame.height - 2 - static_cast<int>(lines.size()), 1);
  const auto y_ticks = ticks(frame.y, std::clamp(rows / 3 + 1, 3, 8));
  std::size_t label_width = 1;
  for (const Tick& tick : y_ticks) label_width = std::max(label_width, tick.label.size());
  const std::size_t margin = label_width + 2;
  const int columns = std::max(frame.width - static_cast<int>(margin), kMinimumCanvasColumns);
  const auto x_ticks = ticks(frame.x, std::clamp(columns / 10, 2, 10));

  BrailleCanvas canvas(columns, rows);
  for (const auto& entry : series) draw_series(canvas, entry, frame);

  for (int row = 0; row < rows; ++row) {
    std::string label;
    for (const Tick& tick : y_ticks) {
      if (rows - 1 - place(tick.value, frame.y, rows) == row) label = tick.label;
    }
    lines.push_back(padded_left(label, label_width) + " " + (label.empty() ? glyph.vertical : glyph.y_tick) +
                    canvas.row(row, terminal));
  }
  std::vector<bool> ticked(static_cast<std::size_t>(columns), false);
  for (const Tick& tick : x_ticks)
    ticked[static_cast<std::size_t>(place(tick.value, frame.x, columns))] = true;
  std::string axis = std::string(label_width + 1, ' ') + glyph.corner;
  for (const bool here : ticked) axis += here ? glyph.x_tick : glyph.horizontal;
  lines.push_back(axis);
  lines.push_back(foot(frame, x_ticks, margin, columns));
  return lines;
}

std::vector<std::string> side_by_side(const std::vector<std::string>& left,
                                      const std::vector<std::string>& right, int gap) {
  std::size_t left_width = 0;
  for (const auto& line : left) left_width = std::max(left_width, display_width(line));
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < std::max(left.size(), right.size()); ++i) {
    lines.push_back(padded(i < left.size() ? left[i] : "", left_width + static_cast<std::size_t>(gap)) +
                    (i < right.size() ? right[i] : ""));
  }
  return lines;
}

}  // namespace hapticd::cli
