#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/error.h"
#include "hal/recording/append_file.h"
#include "hal/recording/mcap_format.h"

namespace hapticd::recording {

/// Writes an MCAP file from front to back. Messages are gathered until close_chunk(), then written at once,
/// compressed. A file that was never finished is whole up to its last chunk. Every error is that of the file;
/// after one nothing of what was to be written is in the file, and it may be finished.
class McapWriter {
 public:
  /// Begins a new file; `library`: the program that writes it.
  static hal::Result<McapWriter> begin(AppendFile file, std::string_view library);
  /// Goes on where `content` ends, to finish a file that was not.
  McapWriter(AppendFile file, Content content);

  /// Adds a schema; returns its id.
  hal::Result<std::uint16_t> add_schema(std::string name, std::string encoding, std::string data);
  hal::Result<std::uint16_t> add_channel(std::uint16_t schema_id, std::string topic,
                                         std::string message_encoding, Texts metadata);
  std::optional<hal::Error> add_metadata(std::string_view name, const Texts& texts);

  void add_message(const Message& message);
  /// Bytes gathered since the last chunk, not compressed.
  std::size_t gathered_bytes() const { return gathered_.size(); }
  std::optional<hal::Error> close_chunk();
  /// Throws away what was gathered.
  void drop_gathered();
  /// Cuts the last chunk off and all that follows it, e.g. to make room for the end. False if there is none,
  /// or the file cannot be cut.
  bool drop_last_chunk();

  /// Writes summary and end. What was gathered must have been written or dropped.
  std::optional<hal::Error> finish();

  /// Content of the finished part.
  const Content& content() const { return content_; }
  AppendFile& file() { return file_; }

 private:
  std::string message_indexes(ChunkIndex& chunk) const;
  std::string summary_from(std::uint64_t start) const;

  /// Place of a message within its chunk.
  struct Place {
    std::uint64_t log_time_ns;
    std::uint64_t offset;
  };

  AppendFile file_;
  Content content_;
  std::string gathered_;
  std::map<std::uint16_t, std::vector<Place>> places_;
};

}  // namespace hapticd::recording
