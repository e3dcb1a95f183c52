#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"

namespace hapticd::cli {

/// A field of dots drawn with Braille characters: each character cell holds 2 × 4 dots and one colour, that
/// of the dot set last. Dot (0, 0) is at the top left.
class BrailleCanvas {
 public:
  BrailleCanvas(int columns, int rows);

  int dot_columns() const noexcept { return 2 * columns_; }
  int dot_rows() const noexcept { return 4 * rows_; }

  /// Draws a dot; outside the canvas nothing happens.
  void dot(int x, int y, Color color);
  /// Draws a straight line of dots between two dots; with `dash` > 0 it is interrupted every `dash` dots.
  void line(int x0, int y0, int x1, int y1, Color color, int dash = 0);

  /// One row of characters, `columns` wide on the terminal.
  std::string row(int row, const Terminal& terminal) const;

 private:
  struct Cell {
    std::uint8_t dots = 0;
    Color color = Color::kDefault;
  };

  std::size_t index(int column, int row) const noexcept {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace hapticd::cli
