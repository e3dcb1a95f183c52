#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/error.h"

namespace hapticd::server {

/// What a number may be, both ends included, and in which unit it is reported.
struct Range {
  double min = 0.0;
  double max = 0.0;
  std::string_view unit;  ///< empty for a pure number
};

/// "0 … 1000 N/mm".
std::string to_text(const Range& range);
/// "0.5 N/mm"; a number alone if there is no unit.
std::string to_text(double value, std::string_view unit);

/// Checks a value: an error when it is not finite or outside its range. `what` names the quantity, e.g.
/// "target stiffness".
std::optional<hal::Error> check(double value, const Range& range, std::string_view what,
                                std::string_view where);

}  // namespace hapticd::server
