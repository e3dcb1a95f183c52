#pragma once

#include <cmath>
#include <sstream>
#include <string>

namespace hapticd::rt {

/// A number with so many digits behind the point; "unknown" where it is none.
inline std::string fixed_text(double value, int digits) {
  if (!std::isfinite(value)) return "unknown";
  std::ostringstream stream;
  stream.setf(std::ios::fixed);
  stream.precision(digits);
  stream << value;
  return stream.str();
}

}  // namespace hapticd::rt
