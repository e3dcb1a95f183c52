#pragma once

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>

namespace hapticd::text {

/// An instant in UTC as ISO 8601 has it, "2026-11-24T00:52:00Z", with `digits` (0 … 9) of the second's
/// fraction, cut off. `unix_ns` ≥ 0, since 1970.
inline std::string utc_text(std::int64_t unix_ns, int digits = 0) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const auto seconds = static_cast<std::time_t>(unix_ns / kSecond);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::string result(text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts));
  if (digits > 0)
    result += "." + std::to_string(kSecond + unix_ns % kSecond).substr(1, static_cast<std::size_t>(digits));
  return result + "Z";
}

}  // namespace hapticd::text
