#pragma once

#include <cstdint>
#include <string>

#include "server/text/toml_reader.h"

namespace hapticd::server {

/// What happens to a recording that needs more room than the quota leaves.
enum class WhenFull : std::uint8_t {
  kStop,          ///< it ends, and no other begins
  kRemoveOldest,  ///< finished recordings make room, the oldest first
};

/// Recordings and incidents in the daemon.
struct RecordingConfig {
  /// [recording] folder: of recordings, incidents and the flight recorder. Empty: next to the store of
  /// models, and if that is in memory nothing is recorded.
  std::string folder;
  double quota_mb = 20'000.0;            ///< [recording] quota_mb: of all recordings together, 10⁶ bytes
  WhenFull when_full = WhenFull::kStop;  ///< [recording] when_full
  /// [recording] keep_free_mb: a recording ends before the disk has less than that left for others.
  double keep_free_mb = 500.0;
  bool flight_recorder = true;         ///< [recording] flight_recorder: the last 30 s, always
  std::string ring_folder;             ///< [recording] ring_folder: of its ring; empty = `folder`
  double incident_quota_mb = 2'000.0;  ///< [recording] incident_quota_mb: the oldest make room
};

void read_recording(TomlTable table, RecordingConfig& recording);
/// Writes the section with every default; reads back as the same.
std::string write_recording(const RecordingConfig& recording);

}  // namespace hapticd::server
