#include "server/recording/recording_sources.h"

#include <cmath>

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

}  // namespace hapticd::server
