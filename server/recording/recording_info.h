#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/recording/bytes.h"

namespace hapticd::server {

enum class RecordingState : std::uint8_t {
  kRunning,
  kFinished,
  kRepaired,    ///< the daemon ended while it ran; it was finished later
  kUnfinished,  ///< has no end: damaged, or of a daemon that ended; readable up to its last chunk
  kForeign,     ///< no recording of hapticd
};

/// What is known of a file without reading its rows.
struct RecordingInfo {
  std::string id;    ///< name of the file, without folder and ending
  std::string name;  ///< as it was chosen
  std::string note;
  std::string by;  ///< identity of the client that started it
  RecordingState state = RecordingState::kFinished;
  std::int64_t started_unix_ns = 0;
  double duration_s = 0.0;  ///< from the first row to the last
  std::uint64_t rows = 0;
  std::uint64_t lost_ticks = 0;
  std::uint64_t bytes = 0;
  std::string end_reason;
  // Fields of an incident.
  std::string cause;  ///< "sensor_stale", "stopped", "overrun", "requested", "unclean_end"
  std::uint64_t cause_tick = 0;
  double cause_after_s = 0.0;  ///< after the first row
  recording::Texts start;      ///< all that was known when it began
};

/// Reads it from a file that is not being written; never fails.
RecordingInfo read_info(const std::string& path);

/// "00012_20261124T005200Z_press.mcap" without the ending: of a number, a time and a name that anyone may
/// have chosen. Only letters, digits, '-', '_' and '.' of the name are kept, at most 64 of them.
std::string file_id(std::uint64_t number, std::int64_t unix_ns, const std::string& name);
/// Number in an id; 0 if there is none, as in files that hapticd did not name.
std::uint64_t number_of_id(const std::string& id);

}  // namespace hapticd::server
