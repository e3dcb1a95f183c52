#pragma once

#include <prometheus/metric_family.h>

#include <cstdint>
#include <string>
#include <vector>

#include "hal/part_report.h"
#include "rt/loop/periodic_loop.h"
#include "rt/record/tick_record.h"

namespace hapticd::server {

/// All that is shown to Prometheus, as copies that exist anyway.
struct RigFigures {
  std::string version;
  std::string rig;
  bool running = false;
  rt::LoopStatistics loop;
  rt::TickRecord last;  ///< the newest record
  bool has_scene = false;
  std::uint32_t subscribers = 0;
  std::uint64_t records_lost = 0;
  bool recording = false;  ///< a recording runs
  std::uint64_t recording_lost_ticks = 0;
  bool flight_recorder_on = false;
  std::uint64_t incidents = 0;  ///< written since the start
  bool lease_is_held = false;
  std::vector<hal::PartReport> parts;  ///< with the drivers' own readings, such as temperatures
};

/// Families for Prometheus. Histograms in seconds, their bounds powers of two of nanoseconds, at which the
/// loop's own histograms are exact. No label has an unbounded number of values.
std::vector<prometheus::MetricFamily> metric_families(const RigFigures& figures);

}  // namespace hapticd::server
