#include "client/cli/plot/braille_canvas.h"

#include <algorithm>
#include <cstdlib>

namespace hapticd::cli {
namespace {

/// Bit of each dot of a cell as Unicode orders them (U+2800 + bits): by row, then column.
constexpr std::uint8_t kDotBits[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
constexpr unsigned kUpperHalf = 0x01U | 0x08U | 0x02U | 0x10U;

std::string character(std::uint8_t dots, bool unicode) {
  if (dots == 0) return " ";
  if (unicode) {
    // U+2800 … U+28FF in UTF-8.
    return {static_cast<char>(0xE2), static_cast<char>(0xA0U | (dots >> 6U)),
            static_cast<char>(0x80U | (dots & 0x3FU))};
  }
  const bool upper = (dots & kUpperHalf) != 0;
  const bool lower = (dots & ~kUpperHalf) != 0;
  return upper && lower ? ":" : (upper ? "'" : ".");
}

}  // namespace

BrailleCanvas::BrailleCanvas(int columns, int rows)
    : columns_(std::max(columns, 1)),
      rows_(std::max(rows, 1)),
      cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

void BrailleCanvas::dot(int x, int y, Color color) {
  if (x < 0 || y < 0 || x >= dot_columns() || y >= dot_rows()) return;
  Cell& cell = cells_[index(x / 2, y / 4)];
  cell.dots = static_cast<std::uint8_t>(cell.dots | kDotBits[y % 4][x % 2]);
  cell.color = color;
}

void BrailleCanvas::line(int x0, int y0, int x1, int y1, Color color, int dash) {
  const int steps = std::max({std::abs(x1 - x0), std::abs(y1 - y0), 1});
  for (int i = 0; i <= steps; ++i) {
    if (dash > 0 && i / dash % 2 == 1) continue;
    const double part = static_cast<double>(i) / steps;
    dot(x0 + static_cast<int>(part * (x1 - x0) + (x1 >= x0 ? 0.5 : -0.5)),
        y0 + static_cast<int>(part * (y1 - y0) + (y1 >= y0 ? 0.5 : -0.5)), color);
  }
}

std::string BrailleCanvas::row(int row, const Terminal& terminal) const {
  std::string text;
  std::string run;
  Color run_color = Color::kDefault;
  for (int column = 0; column < columns_; ++column) {
    const Cell& cell = cells_[index(column, row)];
    if (cell.dots != 0 && cell.color != run_color) {
      text += terminal.paint(run_color, run);
      run.clear();
      run_color = cell.color;
    }
    run += character(cell.dots, terminal.unicode);
  }
  return text + terminal.paint(run_color, run);
}

}  // namespace hapticd::cli
