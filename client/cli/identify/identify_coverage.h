#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "hapticd/v1/identification.pb.h"

namespace hapticd::cli {

/// One cell of a coverage map.
struct CoverageCell {
  enum class State {
    kEmpty,    ///< not asked for and not visited
    kExtra,    ///< not asked for, but visited
    kMissing,  ///< asked for and not visited
    kFew,      ///< asked for, too few samples
    kEnough,   ///< asked for, and enough
  };
  std::uint64_t count = 0;
  State state = State::kEmpty;

  bool required() const noexcept { return state >= State::kMissing; }
};

/// A coverage map in the form it is drawn in. Row 0 is the lowest.
struct CoverageGrid {
  std::size_t columns = 0;
  std::size_t rows = 0;
  std::vector<CoverageCell> cells;  ///< row by row, x fastest

  const CoverageCell& at(std::size_t column, std::size_t row) const { return cells[row * columns + column]; }
};

/// The map's cells, neighbours put together until there are no more than so many columns and rows; a cell put
/// together has enough once all that is asked for in it has. Nothing for a map whose parts do not fit
/// together, or of an older daemon that does not report which cells have enough.
std::optional<CoverageGrid> coverage_grid(const v1::CoverageMap& map, std::size_t max_columns,
                                          std::size_t max_rows);

/// "speed / (mm/s)".
std::string axis_label(const v1::CoverageMap::Axis& axis);

/// Heat map with axes: shades for the number of samples, brackets around the cells asked for. At most `width`
/// columns and `height` lines; empty if that is too small for it or the map says nothing.
std::vector<std::string> draw_coverage(const v1::CoverageMap& map, int width, int height,
                                       const Terminal& terminal);

}  // namespace hapticd::cli
