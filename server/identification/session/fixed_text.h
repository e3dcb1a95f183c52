#pragma once

#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>

namespace hapticd::identification {

/// Number with so many digits behind the point; "unknown" if it is not a number.
inline std::string fixed_text(double value, int digits) {
  if (!std::isfinite(value)) return "unknown";
  std::ostringstream stream;
  stream.setf(std::ios::fixed);
  stream.precision(digits);
  stream << value;
  return stream.str();
}

/// Formats as std::snprintf() does.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char line[200];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

}  // namespace hapticd::identification
