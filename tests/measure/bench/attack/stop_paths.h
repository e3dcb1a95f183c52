#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tests/measure/bench/attack/victim.h"

namespace hapticd::bench {

/// Stops, one after the other.
struct MeasuredStops {
  std::vector<double> late_ms;  ///< one that did not come counts as the time that it was waited for
  /// Time of each stop in which the thread that stops could have run, but waited for a processor; empty if
  /// more than one thread stops.
  std::vector<double> own_wait_ms;
};

/// One way to stop a daemon.
struct StopPath {
  const char* name;
  /// Share of all stops that are asked for; a path that may be slow is measured for a limited time.
  double share;
  bool is_ordinary;  ///< as all that calls gRPC, which spins on its locks; else ahead of the attackers, where
                     ///< it may
  /// Stops again and again, at most `count` times and not much longer than `max_time`.
  MeasuredStops (*measure)(const Victim& victim, const std::string& transport, int count,
                           std::chrono::seconds max_time);
};

/// Paths of a stop. By the stop port, twice: ahead of the attackers, which take the same processors here, as
/// a client on another machine is, and among them; by the service over a connection that exists, and over a
/// new one each; by both at once, as the library does; by SIGUSR1.
///
/// Late is the time from the call to its answer, before which the guard was latched; of a signal, from the
/// signal to the time that the audit log has of it.
const std::vector<StopPath>& stop_paths();

}  // namespace hapticd::bench
