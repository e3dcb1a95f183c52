#include "hal/recording/mcap_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace hapticd::recording {

namespace {

std::string place_of(const std::string& path) {
  return "recording '" + path + "'";
}

/// Whether one more message is wanted; counts what was shown.
enum class Shown : std::uint8_t { kAll, kEnded, kDamaged };

/// Shows the records within a chunk.
Shown show_chunk(std::string_view records, const McapVisitor& visitor, ChunkIndex& index, Content& content) {
  ByteReader reader(records);
  while (!reader.rest().empty()) {
    const auto opcode = static_cast<Opcode>(reader.take<std::uint8_t>());
    const std::string_view body = reader.take_bytes(reader.take<std::uint64_t>());
    if (reader.failed()) return Shown::kDamaged;
    if (opcode == Opcode::kMessage) {
      Message message;
      if (!read(body, message)) return Shown::kDamaged;
      ++index.message_counts[message.channel_id];
      if (visitor.message && !visitor.message(message)) return Shown::kEnded;
    } else if (opcode == Opcode::kSchema) {
      Schema schema;
      if (!read(body, schema)) return Shown::kDamaged;
      if (visitor.schema) visitor.schema(schema);
      content.schemas.push_back(std::move(schema));
    } else if (opcode == Opcode::kChannel) {
      Channel channel;
      if (!read(body, channel)) return Shown::kDamaged;
      if (visitor.channel) visitor.channel(channel);
      content.channels.push_back(std::move(channel));
    }
  }
  return Shown::kAll;
}

struct OpenedChunk {
  ChunkIndex index;
  std::string records;
};

/// Opens a chunk; empty if all is well, else what is damaged.
std::string open_chunk(std::string_view body, OpenedChunk& chunk) {
  ByteReader reader(body);
  chunk.index.start_time_ns = reader.take<std::uint64_t>();
  chunk.index.end_time_ns = reader.take<std::uint64_t>();
  chunk.index.uncompressed_size = reader.take<std::uint64_t>();
  const auto crc = reader.take<std::uint32_t>();
  chunk.index.compression = reader.take_text();
  const std::string_view data = reader.take_bytes(reader.take<std::uint64_t>());
  chunk.index.compressed_size = data.size();
  if (reader.failed()) return "a chunk is damaged";
  if (chunk.index.uncompressed_size > kMaxChunkBytes) return "a chunk is larger than 256 MiB";
  if (chunk.index.compression == "zstd") {
    if (!decompress(data, chunk.index.uncompressed_size, chunk.records)) return "a chunk is damaged";
  } else if (chunk.index.compression.empty()) {
    chunk.records = data;
  } else {
    return "a chunk is compressed with '" + chunk.index.compression + "'; only zstd is read";
  }
  if (crc != 0 && crc != crc32_of(chunk.records)) return "the checksum of a chunk is wrong";
  return {};
}

void count(ChunkIndex index, Content& content) {
  const bool first = content.message_count == 0;
  std::uint64_t messages = 0;
  for (const auto& [channel, n] : index.message_counts) {
    messages += n;
    content.message_counts[channel] += n;
  }
  content.message_count += messages;
  if (messages > 0) {
    content.start_time_ns =
        first ? index.start_time_ns : std::min(content.start_time_ns, index.start_time_ns);
    content.end_time_ns = std::max(content.end_time_ns, index.end_time_ns);
  }
  content.chunks.push_back(std::move(index));
}

bool read_statistics(std::string_view body, Content& content) {
  ByteReader reader(body);
  content.message_count = reader.take<std::uint64_t>();
  reader.take<std::uint16_t>();
  for (int i = 0; i < 4; ++i) reader.take<std::uint32_t>();
  content.start_time_ns = reader.take<std::uint64_t>();
  content.end_time_ns = reader.take<std::uint64_t>();
  ByteReader counts(reader.take_text());
  while (!counts.rest().empty() && !counts.failed()) {
    const auto channel = counts.take<std::uint16_t>();
    content.message_counts[channel] = counts.take<std::uint64_t>();
  }
  return !reader.failed();
}

template <class T>
bool add_to(std::vector<T>& list, std::string_view body) {
  return read(body, list.emplace_back());
}

}  // namespace

hal::Result<McapReader> McapReader::open(const std::string& path, Links links) {
  // A FIFO is opened without a wait for its other end, and refused below.
  const int flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | (links == Links::kRefused ? O_NOFOLLOW : 0);
  const int descriptor = ::open(path.c_str(), flags);
  if (descriptor < 0) {
    return hal::Error::of(hal::ErrorCode::kUnreadable, "the recording cannot be opened", place_of(path),
                          std::strerror(errno), "", "check its path and its rights");
  }
  struct stat status {};
  fstat(descriptor, &status);
  McapReader reader(path, descriptor, static_cast<std::uint64_t>(status.st_size));
  std::string magic;
  if (!S_ISREG(status.st_mode) || !reader.read_at(0, kMagic.size(), magic) || magic != kMagic) {
    return hal::Error::of(hal::ErrorCode::kDamaged, "this is no MCAP recording", place_of(path), "",
                          "a file that hapticctl record made", "a recording in CSV has the ending .csv");
  }
  return reader;
}

McapReader::~McapReader() {
  if (descriptor_ >= 0) close(descriptor_);
}

bool McapReader::is_mcap(const std::string& path) {
  return static_cast<bool>(open(path));
}

bool McapReader::read_at(std::uint64_t offset, std::uint64_t count, std::string& out) const {
  if (offset > size_ || count > size_ - offset) return false;
  out.resize(count);
  std::size_t done = 0;
  while (done < count) {
    const ssize_t got =
        pread(descriptor_, out.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    done += static_cast<std::size_t>(got);
  }
  return true;
}

hal::Result<McapEnd> McapReader::read(const McapVisitor& visitor, std::uint64_t from) const {
  McapEnd end;
  Content& content = end.content;
  std::uint64_t offset = from != 0 ? from : kMagic.size();
  content.end = offset;
  std::string head;
  std::string body;
  while (offset < size_) {
    if (!read_at(offset, kRecordHeadBytes, head)) {
      end.damage = "the last record is cut";
      return end;
    }
    ByteReader reader(head);
    const auto opcode = static_cast<Opcode>(reader.take<std::uint8_t>());
    const auto length = reader.take<std::uint64_t>();
    if (length > size_ - offset - kRecordHeadBytes) {
      end.damage = "the last record is cut";
      return end;
    }
    if (opcode == Opcode::kFooter) {
      end.is_finished = length == 20 && size_ - offset == kFooterBytes + kMagic.size() &&
                        read_at(size_ - kMagic.size(), kMagic.size(), body) && body == kMagic;
      if (!end.is_finished) end.damage = "the end of the file is damaged";
      return end;
    }
    // The end of the data; what follows repeats what was before.
    if (opcode == Opcode::kDataEnd) {
      std::string last;
      end.is_finished = size_ >= kFooterBytes + kMagic.size() &&
                        read_at(size_ - kMagic.size(), kMagic.size(), last) && last == kMagic &&
                        read_at(size_ - kMagic.size() - kFooterBytes, 1, last) &&
                        static_cast<Opcode>(last[0]) == Opcode::kFooter;
      if (!end.is_finished) {
        end.damage = "the end of the file is cut";
      } else if (const auto counted = summary(); counted && counted->message_count != content.message_count) {
        end.damage = "messages that the summary counts are missing";
      }
      return end;
    }
    const bool is_wanted = opcode == Opcode::kChunk || opcode == Opcode::kSchema ||
                           opcode == Opcode::kChannel || opcode == Opcode::kMetadata;
    if (is_wanted && length > 2 * kMaxChunkBytes) {
      end.damage = "a record is larger than 512 MiB";
      return end;
    }
    if (is_wanted && !read_at(offset + kRecordHeadBytes, length, body)) {
      end.damage = "the file cannot be read to its end";
      return end;
    }
    const std::uint64_t record_bytes = kRecordHeadBytes + length;
    bool good = true;
    if (opcode == Opcode::kChunk) {
      OpenedChunk chunk;
      end.damage = open_chunk(body, chunk);
      if (!end.damage.empty()) return end;
      chunk.index.offset = offset;
      chunk.index.length = record_bytes;
      switch (show_chunk(chunk.records, visitor, chunk.index, content)) {
        case Shown::kAll:
          break;
        case Shown::kEnded:
          return end;
        case Shown::kDamaged:
          end.damage = "a chunk is damaged";
          return end;
      }
      count(std::move(chunk.index), content);
    } else if (opcode == Opcode::kSchema) {
      good = add_to(content.schemas, body);
      if (good && visitor.schema) visitor.schema(content.schemas.back());
    } else if (opcode == Opcode::kChannel) {
      good = add_to(content.channels, body);
      if (good && visitor.channel) visitor.channel(content.channels.back());
    } else if (opcode == Opcode::kMetadata) {
      ByteReader metadata_reader(body);
      const std::string name(metadata_reader.take_text());
      const Texts texts = metadata_reader.take_texts();
      good = !metadata_reader.failed();
      if (good) content.metadata.push_back({offset, record_bytes, name});
      if (good && visitor.metadata) visitor.metadata(name, texts);
    } else if (opcode == Opcode::kMessageIndex && !content.chunks.empty() &&
               read_at(offset + kRecordHeadBytes, 2, body)) {
      ChunkIndex& chunk = content.chunks.back();
      chunk.message_index_offsets[ByteReader(body).take<std::uint16_t>()] = offset;
      chunk.message_index_length += record_bytes;
    }
    if (!good) {
      end.damage = "a record is damaged";
      return end;
    }
    offset += record_bytes;
    content.end = offset;
  }
  end.damage = content.end == size_ ? "" : "the last record is cut";
  return end;
}

std::optional<Content> McapReader::summary() const {
  std::string bytes;
  if (size_ < 2 * kMagic.size() + kFooterBytes ||
      !read_at(size_ - kMagic.size() - kFooterBytes, kFooterBytes + kMagic.size(), bytes) ||
      static_cast<Opcode>(bytes[0]) != Opcode::kFooter ||
      std::string_view(bytes).substr(kFooterBytes) != kMagic) {
    return std::nullopt;
  }
  ByteReader footer(std::string_view(bytes).substr(kRecordHeadBytes));
  const auto start = footer.take<std::uint64_t>();
  const auto offset_start = footer.take<std::uint64_t>();
  const auto crc = footer.take<std::uint32_t>();
  const std::uint64_t footer_offset = size_ - kMagic.size() - kFooterBytes;
  const std::uint64_t end = offset_start != 0 ? offset_start : footer_offset;
  if (start == 0 || start > end || end > footer_offset || end - start > kMaxChunkBytes) return std::nullopt;
  std::string all;
  if (!read_at(start, footer_offset - start + kFooterBytes - 4, all)) return std::nullopt;
  if (crc != 0 && crc != crc32_of(all)) return std::nullopt;
  Content content;
  content.end = start;
  ByteReader reader(std::string_view(all).substr(0, end - start));
  while (!reader.rest().empty()) {
    const auto opcode = static_cast<Opcode>(reader.take<std::uint8_t>());
    const std::string_view body = reader.take_bytes(reader.take<std::uint64_t>());
    bool good = !reader.failed();
    if (opcode == Opcode::kSchema) good = good && add_to(content.schemas, body);
    if (opcode == Opcode::kChannel) good = good && add_to(content.channels, body);
    if (opcode == Opcode::kChunkIndex) good = good && add_to(content.chunks, body);
    if (opcode == Opcode::kMetadataIndex) good = good && add_to(content.metadata, body);
    if (opcode == Opcode::kStatistics) good = good && read_statistics(body, content);
    if (!good) return std::nullopt;
  }
  return content;
}

std::optional<Texts> McapReader::metadata(const MetadataIndex& index) const {
  std::string bytes;
  if (index.length > kMaxChunkBytes || !read_at(index.offset, index.length, bytes)) return std::nullopt;
  ByteReader reader(bytes);
  if (static_cast<Opcode>(reader.take<std::uint8_t>()) != Opcode::kMetadata) return std::nullopt;
  reader.take<std::uint64_t>();
  reader.take_text();
  Texts texts = reader.take_texts();
  return reader.failed() ? std::nullopt : std::optional(std::move(texts));
}

}  // namespace hapticd::recording
