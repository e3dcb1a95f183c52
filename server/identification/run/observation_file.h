#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include "hal/error.h"
#include "rt/record/observation.h"
#include "server/identification/run/sha256_stream.h"

namespace hapticd::server {

/// What an identification was fed, kept as a CSV file that can be read again as a recording: times, tip,
/// orientation, sensor load, device command, and outside position where the rig has an instrument for it. A
/// file that cannot be written ends the keeping and nothing else.
class ObservationFile {
 public:
  /// Makes folder and file; an error says why there is none.
  static hal::Result<ObservationFile> create(const std::filesystem::path& path, bool has_external_position);

  /// A sample whose time does not advance by a microsecond is left out: no recording can be read that has
  /// one.
  void add(const rt::Observation& observation);
  /// "PATH, sha256 HASH"; an error where not all of it is on the disk.
  hal::Result<std::string> finish();
  void discard();

 private:
  ObservationFile(std::filesystem::path path, bool has_external_position)
      : path_(std::move(path)), has_external_position_(has_external_position) {}
  void write(const std::string& text);

  std::filesystem::path path_;
  bool has_external_position_;
  std::int64_t last_us_ = std::numeric_limits<std::int64_t>::min();
  std::ofstream stream_;
  std::unique_ptr<Sha256Stream> digest_ = std::make_unique<Sha256Stream>();
  std::string row_;
};

}  // namespace hapticd::server
