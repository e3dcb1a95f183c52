#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace hapticd::replay {

/// A number for messages, with so many significant digits.
inline std::string number_text(double number, int digits = 9) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*g", digits, number);
  return text.data();
}

}  // namespace hapticd::replay
