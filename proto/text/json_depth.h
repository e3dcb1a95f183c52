#pragma once

#include <cstddef>
#include <string_view>

namespace hapticd::text {

/// No text that hapticd reads comes near.
inline constexpr std::size_t kMaxJsonDepth = 32;

/// Whether the brackets of a JSON text nest at most kMaxJsonDepth deep. Checked before a text is parsed: what
/// reads, copies or writes deeper ones may use up the stack.
inline bool is_shallow_json(std::string_view text) {
  std::size_t depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_string) {
      if (c == '\\') ++i;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kMaxJsonDepth) return false;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return true;
}

}  // namespace hapticd::text
