#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "hal/recording/bytes.h"

namespace hapticd::recording {

// MCAP, version 0, as described at mcap.dev: the part of it that hapticd writes. A file is the magic bytes,
// then records (opcode, length, content), and the magic bytes again. Messages are in compressed chunks; what
// follows the last of them, the summary, repeats what is in the file and where.

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

/// Opcode and length of a record.
inline constexpr std::size_t kRecordHeadBytes = 9;
inline constexpr std::size_t kFooterBytes = kRecordHeadBytes + 20;
/// A chunk is read as a whole, so a damaged length must not ask for any memory. hapticd's own have some MB.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{256} << 20U;

struct Schema {
  std::uint16_t id = 0;  ///< not 0
  std::string name;
  std::string encoding;
  std::string data;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic;
  std::string message_encoding;
  Texts metadata;
};

struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;      ///< since 1970, UTC
  std::uint64_t publish_time_ns = 0;  ///< since 1970, UTC
  std::string_view data;              ///< valid only while it is shown
};

struct ChunkIndex {
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::uint64_t offset = 0;  ///< of the chunk's record in the file
  std::uint64_t length = 0;  ///< of the whole record
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts;  ///< by channel; not a part of the record
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

/// What is in a file: the content of its summary.
struct Content {
  std::vector<Schema> schemas;
  std::vector<Channel> channels;
  std::vector<ChunkIndex> chunks;
  std::vector<MetadataIndex> metadata;
  // Message count of the statistics; counted as they are read if there is no summary.
  std::uint64_t message_count = 0;
  std::uint64_t start_time_ns = 0;
  std::uint64_t end_time_ns = 0;
  std::map<std::uint16_t, std::uint64_t> message_counts;
  /// Offset behind the last whole record of the data.
  std::uint64_t end = 0;
};

/// CRC-32 as in zlib; `before`: of the bytes before these.
std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0);

/// Compresses into one zstd frame; level 1.
std::string compressed(std::string_view bytes);
/// False if `bytes` are not such a frame of exactly `size` bytes.
bool decompress(std::string_view bytes, std::uint64_t size, std::string& out);

/// Makes a record as bytes, with opcode and length.
std::string record_of(Opcode opcode, std::string_view content);
std::string record_of(const Schema& schema);
std::string record_of(const Channel& channel);
std::string record_of(const Message& message);
std::string record_of(const ChunkIndex& index);
std::string record_of(const MetadataIndex& index);

/// Reads the content of a record; false if it is damaged.
bool read(std::string_view content, Schema& schema);
bool read(std::string_view content, Channel& channel);
bool read(std::string_view content, Message& message);
bool read(std::string_view content, ChunkIndex& index);
bool read(std::string_view content, MetadataIndex& index);

}  // namespace hapticd::recording
