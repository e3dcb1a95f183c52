#pragma once

#include <optional>
#include <string>

#include "hal/error.h"

namespace hapticd::sim {

/// An error that names field, place, value and range, unless low <= value <= high; NaN is out of every range.
inline std::optional<hal::Error> out_of_range(const char* field, const char* where, double value, double low,
                                              double high, const char* unit) {
  if (value >= low && value <= high) return std::nullopt;
  return hal::Error::of(hal::ErrorCode::kOutOfRange, std::string(field) + " is out of range", where,
                        std::to_string(value),
                        std::to_string(low) + " … " + std::to_string(high) + " " + unit, "");
}

}  // namespace hapticd::sim
