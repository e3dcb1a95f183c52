#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace hapticd::replay {

/// A number for messages, nine significant digits.
inline std::string number_text(double number) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.9g", number);
  return text.data();
}

}  // namespace hapticd::replay
