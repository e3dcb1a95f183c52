#include "hal/recording/mcap_format.h"

#include <zlib.h>
#include <zstd.h>

namespace hapticd::recording {

namespace {

constexpr int kZstdLevel = 1;

void put_counts(const std::map<std::uint16_t, std::uint64_t>& counts, std::string& out) {
  put(static_cast<std::uint32_t>(counts.size() * 10), out);
  for (const auto& [channel, count] : counts) {
    put(channel, out);
    put(count, out);
  }
}

std::map<std::uint16_t, std::uint64_t> take_counts(ByteReader& reader) {
  ByteReader inner(reader.take_text());
  std::map<std::uint16_t, std::uint64_t> counts;
  while (!inner.rest().empty() && !inner.failed()) {
    const auto channel = inner.take<std::uint16_t>();
    counts[channel] = inner.take<std::uint64_t>();
  }
  return counts;
}

}  // namespace

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string compressed(std::string_view bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstdLevel);
  if (ZSTD_isError(size) != 0) return {};  // happens only without memory
  out.resize(size);
  return out;
}

bool decompress(std::string_view bytes, std::uint64_t size, std::string& out) {
  out.resize(size);
  const std::size_t got = ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size());
  return ZSTD_isError(got) == 0 && got == size;
}

std::string record_of(Opcode opcode, std::string_view content) {
  std::string out;
  out.reserve(kRecordHeadBytes + content.size());
  put(static_cast<std::uint8_t>(opcode), out);
  put(static_cast<std::uint64_t>(content.size()), out);
  out += content;
  return out;
}

std::string record_of(const Schema& schema) {
  std::string content;
  put(schema.id, content);
  put_text(schema.name, content);
  put_text(schema.encoding, content);
  put_text(schema.data, content);
  return record_of(Opcode::kSchema, content);
}

std::string record_of(const Channel& channel) {
  std::string content;
  put(channel.id, content);
  put(channel.schema_id, content);
  put_text(channel.topic, content);
  put_text(channel.message_encoding, content);
  put_texts(channel.metadata, content);
  return record_of(Opcode::kChannel, content);
}

std::string record_of(const Message& message) {
  std::string content;
  put(message.channel_id, content);
  put(message.sequence, content);
  put(message.log_time_ns, content);
  put(message.publish_time_ns, content);
  content += message.data;
  return record_of(Opcode::kMessage, content);
}

std::string record_of(const ChunkIndex& index) {
  std::string content;
  put(index.start_time_ns, content);
  put(index.end_time_ns, content);
  put(index.offset, content);
  put(index.length, content);
  put_counts(index.message_index_offsets, content);
  put(index.message_index_length, content);
  put_text(index.compression, content);
  put(index.compressed_size, content);
  put(index.uncompressed_size, content);
  return record_of(Opcode::kChunkIndex, content);
}

std::string record_of(const MetadataIndex& index) {
  std::string content;
  put(index.offset, content);
  put(index.length, content);
  put_text(index.name, content);
  return record_of(Opcode::kMetadataIndex, content);
}

bool read(std::string_view content, Schema& schema) {
  ByteReader reader(content);
  schema.id = reader.take<std::uint16_t>();
  schema.name = reader.take_text();
  schema.encoding = reader.take_text();
  schema.data = reader.take_text();
  return !reader.failed();
}

bool read(std::string_view content, Channel& channel) {
  ByteReader reader(content);
  channel.id = reader.take<std::uint16_t>();
  channel.schema_id = reader.take<std::uint16_t>();
  channel.topic = reader.take_text();
  channel.message_encoding = reader.take_text();
  channel.metadata = reader.take_texts();
  return !reader.failed();
}

bool read(std::string_view content, Message& message) {
  ByteReader reader(content);
  message.channel_id = reader.take<std::uint16_t>();
  message.sequence = reader.take<std::uint32_t>();
  message.log_time_ns = reader.take<std::uint64_t>();
  message.publish_time_ns = reader.take<std::uint64_t>();
  message.data = reader.rest();
  return !reader.failed();
}

bool read(std::string_view content, ChunkIndex& index) {
  ByteReader reader(content);
  index.start_time_ns = reader.take<std::uint64_t>();
  index.end_time_ns = reader.take<std::uint64_t>();
  index.offset = reader.take<std::uint64_t>();
  index.length = reader.take<std::uint64_t>();
  index.message_index_offsets = take_counts(reader);
  index.message_index_length = reader.take<std::uint64_t>();
  index.compression = reader.take_text();
  index.compressed_size = reader.take<std::uint64_t>();
  index.uncompressed_size = reader.take<std::uint64_t>();
  return !reader.failed();
}

bool read(std::string_view content, MetadataIndex& index) {
  ByteReader reader(content);
  index.offset = reader.take<std::uint64_t>();
  index.length = reader.take<std::uint64_t>();
  index.name = reader.take_text();
  return !reader.failed();
}

}  // namespace hapticd::recording
