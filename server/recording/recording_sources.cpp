#include "server/recording/recording_sources.h"

#include <fmt/format.h>

#include <cmath>
#include <ctime>

namespace hapticd::server {

ClockAnchor anchor_of(const RecordingSources& sources) {
  const ClockReading reading = sources.clocks();
  ClockAnchor anchor;
  anchor.time_ns = sources.rig_time_ns();
  anchor.unix_ns = reading.utc_ns;
  // The last tick may be as old as a period.
  anchor.uncertainty_ns = reading.apart_ns + std::llround(1e9 / sources.rate_hz);
  return anchor;
}

recording::Texts texts_of(const ClockAnchor& anchor) {
  return {{"time_ns", std::to_string(anchor.time_ns)},
          {"unix_ns", std::to_string(anchor.unix_ns)},
          {"uncertainty_ns", std::to_string(anchor.uncertainty_ns)}};
}

std::string utc_words(std::int64_t unix_ns) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::time_t seconds = static_cast<std::time_t>(unix_ns / kSecond);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  return fmt::format("{}.{:03d}Z", text, unix_ns % kSecond / 1'000'000);
}

}  // namespace hapticd::server
