#pragma once

#include <memory>
#include <string>
#include <vector>

#include "hal/error.h"
#include "server/recording/flight/flight_ring.h"

namespace hapticd::server {

/// Daemons that may have their rings in one folder at once.
inline constexpr int kMaxRings = 8;

/// Makes a ring in `folder`, under the first name that no running daemon has. Rings that earlier runs left
/// are put aside, and their paths added to `left`. Files that are not rings are removed.
hal::Result<std::unique_ptr<FlightRing>> take_ring(const std::string& folder,
                                                   const std::vector<recording::Column>& columns,
                                                   std::uint64_t capacity_rows, double rate_hz,
                                                   std::vector<std::string>& left);

}  // namespace hapticd::server
