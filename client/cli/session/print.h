#pragma once

#include <fmt/core.h>

#include <string>
#include <string_view>
#include <utility>

namespace hapticd::cli {

// The only ways in which hapticctl writes to a terminal. Texts of the daemon, of other clients and of files
// are in nearly all that it prints, and none of them reaches the terminal raw. deploy/check_arrows.py finds
// other ways.

/// A text with the marks of Terminal::paint() as the terminal gets it: the marks become escape sequences,
/// everything else is printable.
std::string for_terminal(std::string_view text);

/// One line on standard output.
void print_line(std::string_view line);
template <class First, class... More>
void print_line(fmt::format_string<First, More...> form, First&& first, More&&... more) {
  print_line(fmt::format(form, std::forward<First>(first), std::forward<More>(more)...));
}

/// One line on standard error.
void print_error_line(std::string_view line);
template <class First, class... More>
void print_error_line(fmt::format_string<First, More...> form, First&& first, More&&... more) {
  print_error_line(fmt::format(form, std::forward<First>(first), std::forward<More>(more)...));
}

/// A document of several lines, e.g. a scene as TOML, without styles: the ends of its lines and tabs stay.
void print_text(std::string_view text);

/// A part of a live screen: its lines are for_terminal() already, the rest moves the cursor.
void write_frame(std::string_view frame);

/// Whether all that was printed has reached its file or pipe: an empty document of a full disk is no success.
/// errno says why it has not.
bool all_was_printed();

}  // namespace hapticd::cli
