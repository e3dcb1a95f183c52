#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "hal/error.h"
#include "hal/recording/append_file.h"
#include "rt/record/observation.h"
#include "server/identification/run/sha256_stream.h"

namespace hapticd::server {

/// Observations that an identification got, kept as a CSV file that can be read again as a recording: times,
/// tip, orientation, sensor load, device command, and outside position if the rig has an instrument for it.
/// If the file cannot be written, only the keeping ends.
class ObservationFile {
 public:
  /// Makes folder and file, in place of one that an identification without an end has left; an error says why
  /// there is none. `keep_free_mb`: its disk is not filled further than that.
  static hal::Result<ObservationFile> create(const std::filesystem::path& path, bool has_external_position,
                                             double keep_free_mb = 0.0);

  /// Adds an observation. A sample whose time does not advance by a microsecond is left out: no recording can
  /// be read that has one.
  void add(const rt::Observation& observation);
  /// Finishes the file and returns "PATH, sha256 HASH"; an error if not all of it is on the disk.
  hal::Result<std::string> finish();
  void discard();

 private:
  ObservationFile(recording::AppendFile file, bool has_external_position, double keep_free_mb)
      : file_(std::move(file)), has_external_position_(has_external_position), keep_free_mb_(keep_free_mb) {}
  void write(const std::string& text);
  void flush();

  recording::AppendFile file_;
  std::optional<hal::Error> failure_;  ///< of the first write that failed: none follows it
  std::string waiting_;                ///< not written yet
  bool has_external_position_;
  double keep_free_mb_;
  std::int64_t last_us_ = std::numeric_limits<std::int64_t>::min();
  std::unique_ptr<Sha256Stream> digest_ = std::make_unique<Sha256Stream>();
  std::string row_;
};

}  // namespace hapticd::server
