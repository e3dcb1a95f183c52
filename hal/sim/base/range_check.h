#pragma once

#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/shown_text.h"

namespace hapticd::sim {

/// An error that names field, place, value and range, unless low <= value <= high; NaN is out of every range.
inline std::optional<hal::Error> out_of_range(const char* field, const char* where, double value, double low,
                                              double high, const char* unit) {
  if (value >= low && value <= high) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kOutOfRange, std::string(field) + " is out of range", where,
                        hal::number_text(value),
                        hal::number_text(low) + " … " + hal::number_text(high) +
                            (unit[0] == '\0' ? std::string() : std::string(" ") + unit),
                        "choose a value in the range");
}

}  // namespace hapticd::sim
