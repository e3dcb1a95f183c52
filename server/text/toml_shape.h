#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// What a TOML text may be made of before it is parsed. The parser builds a table for each part of a dotted
/// key and walks them by recursion: some thirty thousand parts, 62 kB of text, use up its stack and end the
/// process.
inline constexpr std::size_t kMaxKeyParts = 16;
inline constexpr std::size_t kMaxTomlLine = 16384;  ///< bytes

/// An error with its line where a key (`a.b = 1`, `[a.b]`, `[[a.b]]`, `{ a.b = 1 }`) has more than
/// kMaxKeyParts parts, or a line has more than kMaxTomlLine bytes. Dots in strings and comments count for
/// nothing. Says nothing about whether the text is TOML: that is the parser's.
std::optional<hal::Error> check_toml_shape(std::string_view text, const std::string& source);

}  // namespace hapticd::server
