#include "server/text/range.h"

#include <fmt/format.h>

#include <cmath>

namespace hapticd::server {

std::string to_text(double value, std::string_view unit) {
  return unit.empty() ? fmt::format("{}", value) : fmt::format("{} {}", value, unit);
}

std::string to_text(const Range& range) {
  const std::string numbers = fmt::format("{} … {}", range.min, range.max);
  return range.unit.empty() ? numbers : fmt::format("{} {}", numbers, range.unit);
}

std::optional<hal::Error> check(double value, const Range& range, std::string_view what,
                                std::string_view where) {
  hal::Error error;
  error.where = where;
  error.limit = to_text(range);
  error.value = to_text(value, range.unit);
  if (!std::isfinite(value)) {
    error.what = fmt::format("{} is not finite", what);
    error.value = fmt::format("{}", value);
    error.remedy = "send a finite number";
    error.code = hal::ErrorCode::kNotFinite;
    return error;
  }
  if (value < range.min || value > range.max) {
    error.what = fmt::format("{} is out of range", what);
    error.remedy = value < range.min ? fmt::format("use at least {}", to_text(range.min, range.unit))
                                     : fmt::format("use at most {}", to_text(range.max, range.unit));
    error.code = hal::ErrorCode::kOutOfRange;
    return error;
  }
  return std::nullopt;
}

}  // namespace hapticd::server
