#include "hal/recording/recording_file.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "hal/recording/mcap_writer.h"
#include "hal/recording/recording_names.h"

namespace hapticd::recording {

namespace {

/// Channels by their numbers; known once their records were read.
struct Topics {
  int telemetry = -1;
  int events = -1;

  void note(const Channel& channel) {
    if (channel.message_encoding != "protobuf") return;
    if (channel.topic == kTelemetryTopic) telemetry = channel.id;
    if (channel.topic == kEventTopic) events = channel.id;
  }
};

/// Counts what the end of a recording says of its rows, for one that was finished later.
class RowCount {
 public:
  McapVisitor visitor() {
    McapVisitor parts;
    parts.channel = [this](const Channel& channel) { topics_.note(channel); };
    parts.metadata = [this](const std::string& name, const Texts& texts) {
      if (name != kStartMetadata) return;
      if (const auto found = texts.find("cause_time_ns"); found != texts.end()) {
        cause_time_ns_ = std::strtoll(found->second.c_str(), nullptr, 10);
      }
    };
    parts.message = [this](const Message& message) {
      add(message);
      return true;
    };
    return parts;
  }
  Texts texts() const {
    Texts texts{{"rows", std::to_string(rows_)}, {"lost_ticks", std::to_string(lost_ticks_)}};
    if (first_time_ns_) {
      texts["duration_s"] = std::to_string(1e-9 * static_cast<double>(last_time_ns_ - *first_time_ns_));
    }
    if (cause_time_ns_ && first_time_ns_) {
      texts["cause_after_s"] = std::to_string(1e-9 * static_cast<double>(*cause_time_ns_ - *first_time_ns_));
    }
    return texts;
  }

 private:
  void add(const Message& message) {
    Event event;
    if (message.channel_id == topics_.events && read_event(message.data, event)) {
      lost_ticks_ += event.lost_ticks;
    }
    Block block;
    if (message.channel_id != topics_.telemetry || !read_block(message.data, block)) return;
    if (columns_.empty()) columns_ = std::move(block.columns);
    const std::size_t row_bytes = columns_.size() * kCellBytes;
    if (row_bytes == 0 || block.rows.size() < row_bytes) return;
    rows_ += block.rows.size() / row_bytes;
    if (columns_.size() <= kTimeColumn) return;
    if (!first_time_ns_) first_time_ns_ = Row(block.rows.data(), columns_).integer(kTimeColumn);
    const std::size_t last = block.rows.size() / row_bytes - 1;
    last_time_ns_ = Row(block.rows.data() + last * row_bytes, columns_).integer(kTimeColumn);
  }

  Topics topics_;
  std::vector<Column> columns_;
  std::uint64_t rows_ = 0;
  std::uint64_t lost_ticks_ = 0;
  std::optional<std::int64_t> cause_time_ns_;
  std::optional<std::int64_t> first_time_ns_;
  std::int64_t last_time_ns_ = 0;
};

struct KeptMessage {
  Message head;
  std::string data;
};

}  // namespace

hal::Result<RecordingFile> RecordingFile::open(const std::string& path, Links links) {
  auto reader = McapReader::open(path, links);
  if (!reader) return reader.error();
  Topics topics;
  std::vector<Column> columns;
  bool has_messages = false;
  McapVisitor visitor;
  visitor.channel = [&](const Channel& channel) { topics.note(channel); };
  visitor.message = [&](const Message& message) {
    if (message.channel_id != topics.telemetry) return true;
    has_messages = true;
    Block block;
    if (read_block(message.data, block)) columns = std::move(block.columns);
    return false;
  };
  const auto end = reader->read(visitor);
  if (!end) return end.error();
  if (columns.empty()) {
    const bool foreign = topics.telemetry < 0 || has_messages;
    return hal::Error{
        foreign ? "the file has no telemetry of hapticd" : "there is not one row in the recording",
        "recording '" + path + "'", end->damage,
        "a channel 'telemetry' of TelemetryBlock messages that name their columns",
        foreign ? "give a file that hapticctl record made" : "record for longer"};
  }
  const bool is_own = columns.size() > kTimeColumn && columns[kTickColumn].name == "tick" &&
                      columns[kTimeColumn].name == "time_ns" && columns[kTickColumn].is_integer &&
                      columns[kTimeColumn].is_integer;
  if (!is_own) {
    return hal::Error{"the telemetry of the file does not begin with tick and time_ns",
                      "recording '" + path + "'", columns[0].name, "columns as hapticd records them",
                      "give a file that hapticctl record made"};
  }
  return RecordingFile(std::move(*reader), std::move(columns));
}

hal::Result<McapEnd> RecordingFile::read(const RecordingVisitor& visitor) const {
  Topics topics;
  std::string wrong;
  const std::size_t row_bytes = columns_.size() * kCellBytes;
  McapVisitor parts;
  parts.channel = [&](const Channel& channel) { topics.note(channel); };
  if (visitor.metadata) parts.metadata = visitor.metadata;
  parts.message = [&](const Message& message) {
    if (message.channel_id == topics.events && visitor.event) {
      Event event;
      if (read_event(message.data, event)) visitor.event(event);
    }
    if (message.channel_id != topics.telemetry || !visitor.row) return true;
    Block block;
    if (!read_block(message.data, block) || block.rows.size() % row_bytes != 0) {
      wrong = "a block of telemetry is damaged";
      return false;
    }
    for (std::size_t at = 0; at < block.rows.size(); at += row_bytes) {
      if (!visitor.row(Row(block.rows.data() + at, columns_))) return false;
    }
    return true;
  };
  auto end = reader_.read(parts);
  if (end && !wrong.empty()) end->damage = wrong;
  return end;
}

hal::Result<bool> repair(const std::string& path) {
  auto reader = McapReader::open(path, Links::kRefused);
  if (!reader) return reader.error();
  RowCount counted;
  const auto end = reader->read(counted.visitor());
  if (!end) return end.error();
  if (end->is_finished) return false;

  Content content = end->content;
  // The last chunk may have lost its indexes: it is written again then.
  std::vector<KeptMessage> last;
  if (!content.chunks.empty() &&
      content.chunks.back().message_index_offsets.size() != content.chunks.back().message_counts.size()) {
    const ChunkIndex chunk = content.chunks.back();
    McapVisitor keep;
    keep.message = [&last](const Message& message) {
      last.push_back({message, std::string(message.data)});
      return true;
    };
    if (const auto again = reader->read(keep, chunk.offset); !again) return again.error();
    content.chunks.pop_back();
    for (const auto& [channel, count] : chunk.message_counts) {
      content.message_count -= count;
      content.message_counts[channel] -= count;
    }
    content.end = chunk.offset;
  }
  auto file = AppendFile::resume(path, content.end);
  if (!file) return file.error();
  McapWriter writer(std::move(*file), std::move(content));
  for (KeptMessage& message : last) {
    message.head.data = message.data;
    writer.add_message(message.head);
  }
  if (auto error = writer.close_chunk()) return *error;
  const std::uint64_t lost_bytes = reader->size() - std::min(reader->size(), end->content.end);
  Texts texts = counted.texts();
  texts["reason"] = "the daemon ended before the recording was finished; it was finished later";
  texts["repaired"] = "true";
  texts["cut_bytes"] = std::to_string(lost_bytes);
  if (auto error = writer.add_metadata(kEndMetadata, texts)) return *error;
  if (auto error = writer.finish()) return *error;
  if (auto error = writer.file().sync()) return *error;
  return true;
}

}  // namespace hapticd::recording
