#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "hal/recording/block.h"
#include "hal/recording/mcap_writer.h"
#include "server/recording/recording_sources.h"

namespace hapticd::server {

/// A file of rows and events under way. One thread; another may sync().
class RecordingOutput {
 public:
  /// Begins the file `path`, which must not exist. The beginning is on the disk when this returns; a call
  /// that fails leaves no file. `start`: what is known about the recording (kStartMetadata).
  static hal::Result<RecordingOutput> begin(const std::string& path,
                                            const std::vector<recording::Column>& columns,
                                            const RecordingSources& sources, const ClockAnchor& anchor,
                                            const recording::Texts& start);

  /// Rows that follow one another.
  void add_rows(std::string_view rows);
  /// Adds an event behind what was added before it, also if it happened earlier: the log times of a file, all
  /// by its one anchor, never go back.
  void add_event(const recording::Event& event);
  std::optional<hal::Error> add_metadata(std::string_view name, const recording::Texts& texts);
  /// Closes a chunk: what was added is on its way to the disk, and survives the process.
  std::optional<hal::Error> close_chunk();
  std::optional<hal::Error> sync() { return writer_.file().sync(); }

  /// Finishes the file. If there is no room for that, the last chunks make it; the rows that this costs are
  /// counted in `end`. An error if the file has no end all the same: it can be repaired later.
  std::optional<hal::Error> finish(recording::Texts end);

  std::uint64_t rows() const { return rows_; }
  std::uint64_t bytes() { return writer_.file().size(); }
  std::size_t gathered_bytes() const { return writer_.gathered_bytes(); }
  const ClockAnchor& anchor() const { return anchor_; }

 private:
  RecordingOutput(recording::McapWriter writer, const std::vector<recording::Column>& columns,
                  const ClockAnchor& anchor)
      : writer_(std::move(writer)),
        columns_(columns),
        description_(recording::describe(columns)),
        anchor_(anchor) {}
  static hal::Result<RecordingOutput> begin(recording::AppendFile file,
                                            const std::vector<recording::Column>& columns,
                                            const RecordingSources& sources, const ClockAnchor& anchor,
                                            const recording::Texts& start);
  /// The rows up to the end of a chunk.
  struct Chunk {
    std::uint64_t rows = 0;
    std::int64_t last_time_ns = 0;
  };
  std::optional<hal::Error> write_end(recording::Texts& end);
  void add_message(std::uint16_t channel, std::uint32_t number, std::int64_t time_ns, std::string_view data);

  recording::McapWriter writer_;
  std::vector<recording::Column> columns_;
  std::string description_;  ///< of the columns; in the first block of each chunk
  ClockAnchor anchor_;
  std::uint16_t telemetry_ = 0;
  std::uint16_t events_ = 0;
  std::uint32_t blocks_ = 0;
  std::uint32_t event_count_ = 0;
  std::uint64_t rows_ = 0;
  std::uint64_t rows_gathered_ = 0;
  std::vector<Chunk> chunks_;
  std::optional<std::int64_t> first_time_ns_;  ///< of a row
  std::int64_t last_time_ns_ = 0;              ///< of a row, gathered or written
  std::int64_t last_log_ns_ = 0;
  bool described_ = false;  ///< in this chunk
};

}  // namespace hapticd::server
