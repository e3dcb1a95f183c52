#pragma once

#include <algorithm>
#include <string_view>

namespace hapticd::console {

/// True if gRPC takes this text as a value of a call's metadata: up to 1 kB of printable ASCII. It ends the
/// process on any other, so whatever comes from elsewhere is checked here first.
inline bool is_metadata_value(std::string_view text) {
  constexpr std::size_t kMax = 1024;
  return text.size() <= kMax &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace hapticd::console
