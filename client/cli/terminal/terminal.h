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

  /// `text` in `color` if colours are shown: with style marks, not yet with escape sequences.
  std::string paint(Color color, std::string_view text) const;
  std::string bold(std::string_view text) const;
};

/// Mark before the letter of a style in a text that for_terminal() prints (session/print.h). No UTF-8 has
/// this byte, so no text of a message does: what a daemon sends cannot be taken for a style.
inline constexpr char kStyleMark = '\xff';
/// The escape sequence of the style with this letter; empty for an unknown letter.
std::string style_code(char style);

/// Text without anything that a terminal would obey (proto/text); style marks stay.
std::string printable(std::string_view text);

/// Columns that `text` takes on a terminal; style marks take none.
std::size_t display_width(std::string_view text);
/// Padded with blanks on the right to `width` columns; a longer text is cut.
std::string padded(std::string_view text, std::size_t width);
/// Breaks a text into lines of at most `width` columns, between words; a longer word gets a separate line,
/// whole. One line at least.
std::vector<std::string> wrapped(std::string_view text, std::size_t width);
/// Padded on the left.
std::string padded_left(std::string_view text, std::size_t width);

}  // namespace hapticd::cli
