#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::cli {

enum class Color { kDefault, kGrey, kRed, kGreen, kYellow, kBlue, kMagenta, kCyan };

/// What the terminal behind standard output can show.
struct Terminal {
  bool live = false;     ///< a terminal on which frames can be redrawn in place
  bool color = false;    ///< NO_COLOR and TERM=dumb are respected
  bool unicode = false;  ///< Braille dots and box lines; plain ASCII otherwise
  int width = 80;        ///< in columns
  int height = 24;       ///< in rows

  /// Asks the terminal and the environment, afresh at each call (windows change size).
  static Terminal detect();

  /// `text` in `color` where colours are shown.
  std::string paint(Color color, std::string_view text) const;
  std::string bold(std::string_view text) const;
};

/// Columns that `text` takes on a terminal; escape sequences take none.
std::size_t display_width(std::string_view text);
/// Padded with blanks on the right to `width` columns; a longer text is cut.
std::string padded(std::string_view text, std::size_t width);
/// In lines of at most `width` columns, broken between words; a longer word has a line of its own, whole. One
/// line at least.
std::vector<std::string> wrapped(std::string_view text, std::size_t width);
/// Padded on the left.
std::string padded_left(std::string_view text, std::size_t width);

}  // namespace hapticd::cli
