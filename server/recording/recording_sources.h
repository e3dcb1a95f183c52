#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "hal/lock/callback.h"
#include "hal/recording/bytes.h"
#include "server/process/system_clock.h"
#include "server/telemetry/telemetry_column.h"

namespace hapticd::server {

/// What the rest of the daemon gives to those who record.
struct RecordingSources {
  std::span<const TelemetryColumn> columns;
  std::uint32_t channels = 0;  ///< groups that this rig may fill, bits of rt::channel
  double rate_hz = 1000.0;     ///< of the loop
  /// Schemas for readers that know nothing of hapticd: FileDescriptorSets of the two messages.
  std::string block_schema;
  std::string event_schema;
  recording::Texts rig;                  ///< what is known of rig, daemon and machine; any key
  std::string configuration;             ///< of the daemon, TOML
  Callback<recording::Texts()> scene;    ///< the loaded one: name, text, hashes of its models; empty: none
  Callback<std::int64_t()> rig_time_ns;  ///< of the last tick
  Callback<ClockReading()> clocks = read_clocks;
};

/// CLOCK_REALTIME against the rig's clock, now.
struct ClockAnchor {
  std::int64_t time_ns = 0;  ///< of the rig
  std::int64_t unix_ns = 0;  ///< since 1970, UTC
  std::int64_t uncertainty_ns = 0;

  /// UTC at a time of the rig, by this anchor.
  std::int64_t unix_at(std::int64_t rig_time_ns) const { return unix_ns + (rig_time_ns - time_ns); }
};
ClockAnchor anchor_of(const RecordingSources& sources);
/// Anchor as metadata of a recording.
recording::Texts texts_of(const ClockAnchor& anchor);

}  // namespace hapticd::server
