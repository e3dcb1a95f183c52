#pragma once

#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>

namespace hapticd::identification {

/// A number with so many digits behind the point; "unknown" where it is none.
inline std::string fixed_text(double value, int digits) {
  if (!std::isfinite(value)) return "unknown";
  std::ostringstream stream;
  stream.setf(std::ios::fixed);
  stream.precision(digits);
  stream << value;
  return stream.str();
}

/// As std::snprintf() writes it.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char line[200];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

}  // namespace hapticd::identification
