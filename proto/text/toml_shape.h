#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace hapticd::text {

/// Limits of a TOML text, checked before it is parsed. The parser builds a table for each part of a dotted
/// key and visits them recursively: some thirty thousand parts, 62 kB of text, overflow its stack and end the
/// process.
inline constexpr std::size_t kMaxKeyParts = 16;
inline constexpr std::size_t kMaxTomlLine = 16384;  ///< bytes
/// Keys, each part of them, and values of arrays. The parser keeps up to 500 bytes for each: 1 MiB of text
/// without this limit would become 100 MB. The largest scene has some 4 200, most of them a surface's
/// heights.
inline constexpr std::size_t kMaxTomlItems = 10000;

/// Problem with the shape of a TOML text. The caller adds which text it is.
struct TomlShapeProblem {
  const char* what;
  std::size_t line;
  std::string value;
  std::string limit;
  const char* remedy;
};

/// Checks the shape: a problem with its line if a key (`a.b = 1`, `[a.b]`, `[[a.b]]`, `{ a.b = 1 }`) has more
/// than kMaxKeyParts parts, a line has more than kMaxTomlLine bytes, or the text has more than kMaxTomlItems
/// keys and values. Strings and comments are not looked into. Whether the text is TOML is left to
/// the parser.
std::optional<TomlShapeProblem> check_toml_shape(std::string_view text);

}  // namespace hapticd::text
