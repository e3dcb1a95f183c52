#pragma once

#include <string>
#include <string_view>

namespace hapticd::text {

/// The text with U+FFFD for every byte that is not part of well-formed UTF-8. Text from files and clients is
/// repaired by this before it goes into a message, since protobuf sends only UTF-8.
std::string repaired_utf8(std::string_view text);
bool is_utf8(std::string_view text);

/// A UTF-8 text cut to at most so many bytes (3 or more), between two characters; a text that was cut ends in
/// "…".
std::string shortened(std::string_view text, std::size_t max_bytes);

/// The text as a terminal or a log may get it: on one line, without anything that a terminal would obey or
/// that would reorder what is shown. The control characters (C0, DEL, C1), the ends of lines of Unicode
/// (U+2028, U+2029) and the marks of direction (U+061C, U+200E, U+200F, U+202A … U+202E, U+2066 … U+2069) are
/// written as escapes: `\n`, `\r`, `\t`, `\u001b`. They are those of JSON and TOML, so a text in one of these
/// keeps its meaning. Bytes that are not UTF-8 become U+FFFD. A printable text stays as it is.
std::string printable(std::string_view text);

/// Printable text of many lines: '\n' and '\t' stay.
std::string printable_lines(std::string_view text);

}  // namespace hapticd::text
