#pragma once

#include <fmt/core.h>

#include <string>
#include <string_view>
#include <utility>

namespace hapticd::cli {

// The only ways in which hapticctl writes to a terminal. Texts of the daemon, of other clients and of files
// are in nearly all that it prints, and none of them reaches the terminal raw. deploy/check_arrows.py finds
// other ways.

/// Turns a text with the marks of Terminal::paint() into what the terminal gets: the marks become escape
/// sequences, everything else is printable.
std::string for_terminal(std::string_view text);

/// Prints one line on standard output.
void print_line(std::string_view line);
template <class First, class... More>
void print_line(fmt::format_string<First, More...> form, First&& first, More&&... more) {
  print_line(fmt::format(form, std::forward<First>(first), std::forward<More>(more)...));
}

/// Prints one line on standard error.
void print_error_line(std::string_view line);
template <class First, class... More>
void print_error_line(fmt::format_string<First, More...> form, First&& first, More&&... more) {
  print_error_line(fmt::format(form, std::forward<First>(first), std::forward<More>(more)...));
}

/// Prints a document of several lines, e.g. a scene as TOML, without styles: the ends of its lines and tabs
/// stay.
void print_text(std::string_view text);

/// Writes a part of a live screen: its lines are for_terminal() already, the rest moves the cursor.
void write_frame(std::string_view frame);

/// True if all that was printed has reached its file or pipe: an empty document on a full disk is a failure.
/// errno says why it has not.
bool all_was_printed();

}  // namespace hapticd::cli
