#include "hal/recording/mcap_writer.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace hapticd::recording {

namespace {

constexpr std::string_view kCompression = "zstd";

std::uint16_t next_id(std::size_t count) {
  return static_cast<std::uint16_t>(count + 1);
}

}  // namespace

hal::Result<McapWriter> McapWriter::begin(AppendFile file, std::string_view library) {
  std::string content;
  put_text("hapticd", content);
  put_text(library, content);
  const std::string bytes = std::string(kMagic) + record_of(Opcode::kHeader, content);
  if (auto error = file.append(bytes)) return *error;
  Content empty;
  empty.end = file.size();
  return McapWriter(std::move(file), std::move(empty));
}

McapWriter::McapWriter(AppendFile file, Content content)
    : file_(std::move(file)), content_(std::move(content)) {}

hal::Result<std::uint16_t> McapWriter::add_schema(std::string name, std::string encoding, std::string data) {
  Schema schema{next_id(content_.schemas.size()), std::move(name), std::move(encoding), std::move(data)};
  if (auto error = file_.append(record_of(schema))) return *error;
  content_.end = file_.size();
  content_.schemas.push_back(std::move(schema));
  return content_.schemas.back().id;
}

hal::Result<std::uint16_t> McapWriter::add_channel(std::uint16_t schema_id, std::string topic,
                                                   std::string message_encoding, Texts metadata) {
  Channel channel{next_id(content_.channels.size()), schema_id, std::move(topic), std::move(message_encoding),
                  std::move(metadata)};
  if (auto error = file_.append(record_of(channel))) return *error;
  content_.end = file_.size();
  content_.channels.push_back(std::move(channel));
  return content_.channels.back().id;
}

std::optional<hal::Error> McapWriter::add_metadata(std::string_view name, const Texts& texts) {
  std::string content;
  put_text(name, content);
  put_texts(texts, content);
  const std::string bytes = record_of(Opcode::kMetadata, content);
  const std::uint64_t offset = file_.size();
  if (auto error = file_.append(bytes)) return error;
  content_.end = file_.size();
  content_.metadata.push_back({offset, bytes.size(), std::string(name)});
  return std::nullopt;
}

void McapWriter::add_message(const Message& message) {
  places_[message.channel_id].push_back({message.log_time_ns, gathered_.size()});
  gathered_ += record_of(message);
}

void McapWriter::drop_gathered() {
  gathered_.clear();
  places_.clear();
}

std::string McapWriter::message_indexes(ChunkIndex& chunk) const {
  std::string bytes;
  for (const auto& [channel, places] : places_) {
    std::string content;
    put(channel, content);
    put(static_cast<std::uint32_t>(places.size() * 16), content);
    for (const Place& place : places) {
      put(place.log_time_ns, content);
      put(place.offset, content);
    }
    chunk.message_index_offsets[channel] = chunk.offset + chunk.length + bytes.size();
    chunk.message_counts[channel] = places.size();
    bytes += record_of(Opcode::kMessageIndex, content);
  }
  chunk.message_index_length = bytes.size();
  return bytes;
}

std::optional<hal::Error> McapWriter::close_chunk() {
  if (gathered_.empty()) return std::nullopt;
  ChunkIndex chunk;
  chunk.start_time_ns = std::numeric_limits<std::uint64_t>::max();
  for (const auto& [channel, places] : places_) {
    for (const Place& place : places) {
      chunk.start_time_ns = std::min(chunk.start_time_ns, place.log_time_ns);
      chunk.end_time_ns = std::max(chunk.end_time_ns, place.log_time_ns);
    }
  }
  const std::string data = compressed(gathered_);
  chunk.compression = kCompression;
  chunk.compressed_size = data.size();
  chunk.uncompressed_size = gathered_.size();
  std::string content;
  content.reserve(data.size() + 64);
  put(chunk.start_time_ns, content);
  put(chunk.end_time_ns, content);
  put(chunk.uncompressed_size, content);
  put(crc32_of(gathered_), content);
  put_text(kCompression, content);
  put(chunk.compressed_size, content);
  content += data;
  std::string bytes = record_of(Opcode::kChunk, content);
  chunk.offset = file_.size();
  chunk.length = bytes.size();
  bytes += message_indexes(chunk);
  if (auto error = file_.append(bytes)) return error;

  content_.end = file_.size();
  if (content_.message_count == 0) content_.start_time_ns = chunk.start_time_ns;
  content_.start_time_ns = std::min(content_.start_time_ns, chunk.start_time_ns);
  content_.end_time_ns = std::max(content_.end_time_ns, chunk.end_time_ns);
  for (const auto& [channel, count] : chunk.message_counts) {
    content_.message_count += count;
    content_.message_counts[channel] += count;
  }
  content_.chunks.push_back(std::move(chunk));
  drop_gathered();
  return std::nullopt;
}

bool McapWriter::drop_last_chunk() {
  if (content_.chunks.empty()) return false;
  const ChunkIndex& chunk = content_.chunks.back();
  if (file_.truncate(chunk.offset)) return false;
  for (const auto& [channel, count] : chunk.message_counts) {
    content_.message_count -= count;
    content_.message_counts[channel] -= count;
  }
  const std::uint64_t end = chunk.offset;
  std::erase_if(content_.metadata, [&](const MetadataIndex& index) { return index.offset > end; });
  content_.end = end;
  content_.chunks.pop_back();
  content_.end_time_ns = 0;
  for (const ChunkIndex& left : content_.chunks) {
    content_.end_time_ns = std::max(content_.end_time_ns, left.end_time_ns);
  }
  if (content_.chunks.empty()) content_.start_time_ns = 0;
  return true;
}

std::string McapWriter::summary_from(std::uint64_t start) const {
  std::string bytes;
  std::string offsets;
  const auto add_group = [&](Opcode opcode, const std::string& records) {
    if (records.empty()) return;
    std::string content;
    put(static_cast<std::uint8_t>(opcode), content);
    put(start + bytes.size(), content);
    put(static_cast<std::uint64_t>(records.size()), content);
    offsets += record_of(Opcode::kSummaryOffset, content);
    bytes += records;
  };
  std::string records;
  for (const Schema& schema : content_.schemas) records += record_of(schema);
  add_group(Opcode::kSchema, records);
  records.clear();
  for (const Channel& channel : content_.channels) records += record_of(channel);
  add_group(Opcode::kChannel, records);

  std::string statistics;
  put(content_.message_count, statistics);
  put(static_cast<std::uint16_t>(content_.schemas.size()), statistics);
  put(static_cast<std::uint32_t>(content_.channels.size()), statistics);
  put(std::uint32_t{0}, statistics);  // attachments
  put(static_cast<std::uint32_t>(content_.metadata.size()), statistics);
  put(static_cast<std::uint32_t>(content_.chunks.size()), statistics);
  put(content_.start_time_ns, statistics);
  put(content_.end_time_ns, statistics);
  put(static_cast<std::uint32_t>(content_.message_counts.size() * 10), statistics);
  for (const auto& [channel, count] : content_.message_counts) {
    put(channel, statistics);
    put(count, statistics);
  }
  add_group(Opcode::kStatistics, record_of(Opcode::kStatistics, statistics));

  records.clear();
  for (const ChunkIndex& chunk : content_.chunks) records += record_of(chunk);
  add_group(Opcode::kChunkIndex, records);
  records.clear();
  for (const MetadataIndex& index : content_.metadata) records += record_of(index);
  add_group(Opcode::kMetadataIndex, records);

  const std::uint64_t offset_start = start + bytes.size();
  bytes += offsets;
  // The footer; its checksum covers the summary and its own first fields.
  put(static_cast<std::uint8_t>(Opcode::kFooter), bytes);
  put(std::uint64_t{20}, bytes);
  put(start, bytes);
  put(offset_start, bytes);
  put(crc32_of(bytes), bytes);
  return bytes;
}

std::optional<hal::Error> McapWriter::finish() {
  std::string end;
  put(std::uint32_t{0}, end);  // no checksum of all data: each chunk has its own
  const std::string data_end = record_of(Opcode::kDataEnd, end);
  const std::uint64_t start = file_.size() + data_end.size();
  return file_.append(data_end + summary_from(start) + std::string(kMagic));
}

}  // namespace hapticd::recording
