#pragma once

#include <cstdio>
#include <string>
#include <vector>

namespace hapticd::openhaptics {

/// "a, b, c".
inline std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// A number for messages, five significant digits.
inline std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.5g", value);
  return text;
}

}  // namespace hapticd::openhaptics
