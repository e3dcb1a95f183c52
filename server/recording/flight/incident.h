#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hal/recording/block.h"
#include "server/recording/flight/flight_ring.h"
#include "server/recording/recording_sources.h"

namespace hapticd::server {

/// What is to be kept of the ring, and why.
struct Incident {
  std::string cause;   ///< "sensor_stale", "stopped", "overrun", "requested", "unclean_end"
  std::string words;   ///< what it means, what else happened meanwhile
  std::string remedy;  ///< may be empty
  std::uint64_t tick = 0;
  std::int64_t time_ns = 0;  ///< of the rig
  std::int64_t unix_ns = 0;
  std::uint64_t first_row = 0;
  std::uint64_t row_count = 0;
  std::vector<recording::Event> events;
};

/// Writes rows of a ring as a recording to `path`. Rows that were overwritten meanwhile, or are damaged, are
/// missing, and counted as such. An error if the file cannot be written.
std::optional<hal::Error> write_incident(const Incident& incident, const FlightRing& ring,
                                         const RecordingSources& sources, const FlightRing::Notes& notes,
                                         const std::string& path);

}  // namespace hapticd::server
