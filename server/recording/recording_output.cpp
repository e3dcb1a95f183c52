#include "server/recording/recording_output.h"

#include <utility>

#include "hal/recording/recording_names.h"
#include "server/process/version.h"

namespace hapticd::server {

hal::Result<RecordingOutput> RecordingOutput::begin(const std::string& path,
                                                    const std::vector<recording::Column>& columns,
                                                    const RecordingSources& sources,
                                                    const ClockAnchor& anchor,
                                                    const recording::Texts& start) {
  auto file = recording::AppendFile::create(path);
  if (!file) return file.error();
  auto writer = recording::McapWriter::begin(std::move(*file), std::string("hapticd ") + version());
  if (!writer) return writer.error();
  const auto block = writer->add_schema(recording::kBlockSchema, "protobuf", sources.block_schema);
  if (!block) return block.error();
  const auto event = writer->add_schema(recording::kEventSchema, "protobuf", sources.event_schema);
  if (!event) return event.error();
  const auto telemetry = writer->add_channel(*block, recording::kTelemetryTopic, "protobuf", {});
  if (!telemetry) return telemetry.error();
  const auto events = writer->add_channel(*event, recording::kEventTopic, "protobuf", {});
  if (!events) return events.error();
  RecordingOutput output(std::move(*writer), columns.size() * recording::kCellBytes,
                         recording::describe(columns), anchor);
  output.telemetry_ = *telemetry;
  output.events_ = *events;
  if (auto error = output.add_metadata(recording::kStartMetadata, start)) return *error;
  if (auto error = output.add_metadata(recording::kConfigurationMetadata, {{"toml", sources.configuration}}))
    return *error;
  if (auto error = output.add_metadata(recording::kAnchorMetadata, texts_of(anchor))) return *error;
  return output;
}

void RecordingOutput::add_rows(std::string_view rows, std::int64_t first_time_ns) {
  if (rows.empty()) return;
  const std::string data = recording::block_message(
      std::exchange(described_, true) ? std::string_view() : std::string_view(description_), rows);
  const auto unix_ns = static_cast<std::uint64_t>(anchor_.unix_at(first_time_ns));
  writer_.add_message({telemetry_, blocks_++, unix_ns, unix_ns, data});
  rows_gathered_ += rows.size() / row_bytes_;
}

void RecordingOutput::add_event(const recording::Event& event) {
  const auto unix_ns = static_cast<std::uint64_t>(event.unix_ns);
  writer_.add_message({events_, event_count_++, unix_ns, unix_ns, recording::event_message(event)});
}

std::optional<hal::Error> RecordingOutput::add_metadata(std::string_view name,
                                                        const recording::Texts& texts) {
  return writer_.add_metadata(name, texts);
}

std::optional<hal::Error> RecordingOutput::close_chunk() {
  if (writer_.gathered_bytes() == 0) return std::nullopt;
  if (auto error = writer_.close_chunk()) return error;
  rows_of_chunks_.push_back(rows_gathered_);
  rows_ += std::exchange(rows_gathered_, 0);
  described_ = false;
  return std::nullopt;
}

std::optional<hal::Error> RecordingOutput::write_end(recording::Texts& end) {
  end["rows"] = std::to_string(rows_);
  if (auto error = writer_.add_metadata(recording::kEndMetadata, end)) return error;
  return writer_.finish();
}

std::optional<hal::Error> RecordingOutput::finish(recording::Texts end) {
  auto error = close_chunk();
  std::uint64_t lost = 0;
  if (error) {
    lost = std::exchange(rows_gathered_, 0);
    writer_.drop_gathered();
  }
  if (lost > 0) end["rows_lost_at_the_end"] = std::to_string(lost);
  error = write_end(end);
  // Without room even for the end: chunks make it, the last first. Their rows are lost, and said to be.
  while (error && !rows_of_chunks_.empty() && writer_.drop_last_chunk()) {
    lost += rows_of_chunks_.back();
    rows_ -= rows_of_chunks_.back();
    rows_of_chunks_.pop_back();
    end["rows_lost_at_the_end"] = std::to_string(lost);
    error = write_end(end);
  }
  if (error) return error;
  return writer_.file().sync();
}

}  // namespace hapticd::server
