#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/error.h"
#include "hal/recording/block.h"
#include "hal/recording/mcap_reader.h"

namespace hapticd::recording {

/// Columns that every recording begins with.
inline constexpr std::size_t kTickColumn = 0;
inline constexpr std::size_t kTimeColumn = 1;  ///< "time_ns"

/// What a reader wants to see of a recording, in the order in which it was written.
struct RecordingVisitor {
  /// False ends the reading.
  std::function<bool(const Row&)> row{};
  std::function<void(const Event&)> event{};
  std::function<void(const std::string& name, const Texts&)> metadata{};
};

/// A recording of the daemon as a table of numbers, events and what is known about them.
class RecordingFile {
 public:
  /// Reads up to the first rows. An error if it is not an MCAP file, or has no telemetry of hapticd.
  static hal::Result<RecordingFile> open(const std::string& path, Links links = Links::kFollowed);

  /// "tick", "time_ns", "scene_generation", then the groups that were recorded.
  const std::vector<Column>& columns() const { return columns_; }
  /// Reads the file and says how it ended; `damage` is empty for one that is whole.
  hal::Result<McapEnd> read(const RecordingVisitor& visitor) const;
  const McapReader& mcap() const { return reader_; }

 private:
  RecordingFile(McapReader reader, std::vector<Column> columns)
      : reader_(std::move(reader)), columns_(std::move(columns)) {}

  McapReader reader_;
  std::vector<Column> columns_;
};

/// Finishes a file that was not: what follows its last whole chunk is cut off, and an end is written, which
/// says so. Does nothing to one that is finished. True if it was repaired.
hal::Result<bool> repair(const std::string& path);

}  // namespace hapticd::recording
