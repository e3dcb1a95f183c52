#pragma once

#include <cstdio>
#include <string>

namespace hapticd::netft {

/// A number for messages, to `digits` significant digits.
inline std::string number_text(double value, int digits = 6) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

}  // namespace hapticd::netft
