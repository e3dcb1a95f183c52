#include "server/recording/recording_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "hal/recording/recording_file.h"
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
  auto output = begin(std::move(*file), columns, sources, anchor, start);
  if (!output) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }
  return output;
}

hal::Result<RecordingOutput> RecordingOutput::begin(recording::AppendFile file,
                                                    const std::vector<recording::Column>& columns,
                                                    const RecordingSources& sources,
                                                    const ClockAnchor& anchor,
                                                    const recording::Texts& start) {
  auto writer = recording::McapWriter::begin(std::move(file), std::string("hapticd ") + version());
  if (!writer) return writer.error();
  const auto block = writer->add_schema(recording::kBlockSchema, "protobuf", sources.block_schema);
  if (!block) return block.error();
  const auto event = writer->add_schema(recording::kEventSchema, "protobuf", sources.event_schema);
  if (!event) return event.error();
  const auto telemetry = writer->add_channel(*block, recording::kTelemetryTopic, "protobuf", {});
  if (!telemetry) return telemetry.error();
  const auto events = writer->add_channel(*event, recording::kEventTopic, "protobuf", {});
  if (!events) return events.error();
  RecordingOutput output(std::move(*writer), columns, anchor);
  output.telemetry_ = *telemetry;
  output.events_ = *events;
  if (auto error = output.add_metadata(recording::kStartMetadata, start)) return *error;
  if (auto error = output.add_metadata(recording::kConfigurationMetadata, {{"toml", sources.configuration}}))
    return *error;
  if (auto error = output.add_metadata(recording::kAnchorMetadata, texts_of(anchor))) return *error;
  if (auto error = output.sync()) return *error;
  return output;
}

void RecordingOutput::add_message(std::uint16_t channel, std::uint32_t number, std::int64_t time_ns,
                                  std::string_view data) {
  const std::int64_t unix_ns = anchor_.unix_at(time_ns);
  last_log_ns_ = std::max(last_log_ns_, unix_ns);
  writer_.add_message(
      {channel, number, static_cast<std::uint64_t>(last_log_ns_), static_cast<std::uint64_t>(unix_ns), data});
}

void RecordingOutput::add_rows(std::string_view rows) {
  if (rows.empty()) return;
  const std::size_t row_bytes = columns_.size() * recording::kCellBytes;
  const auto time_at = [&](std::size_t at) {
    return recording::Row(rows.data() + at, columns_).integer(recording::kTimeColumn);
  };
  const std::int64_t first_time_ns = time_at(0);
  if (!first_time_ns_) first_time_ns_ = first_time_ns;
  last_time_ns_ = time_at(rows.size() - row_bytes);
  const std::string data = recording::block_message(
      std::exchange(described_, true) ? std::string_view() : std::string_view(description_), rows);
  add_message(telemetry_, blocks_++, first_time_ns, data);
  rows_gathered_ += rows.size() / row_bytes;
}

void RecordingOutput::add_event(const recording::Event& event) {
  add_message(events_, event_count_++, event.time_ns, recording::event_message(event));
}

std::optional<hal::Error> RecordingOutput::add_metadata(std::string_view name,
                                                        const recording::Texts& texts) {
  return writer_.add_metadata(name, texts);
}

std::optional<hal::Error> RecordingOutput::close_chunk() {
  if (writer_.gathered_bytes() == 0) return std::nullopt;
  if (auto error = writer_.close_chunk()) return error;
  chunks_.push_back({rows_gathered_, last_time_ns_});
  rows_ += std::exchange(rows_gathered_, 0);
  described_ = false;
  return std::nullopt;
}

std::optional<hal::Error> RecordingOutput::write_end(recording::Texts& end) {
  end["rows"] = std::to_string(rows_);
  const bool has_rows = rows_ > 0 && first_time_ns_.has_value() && !chunks_.empty();
  const std::int64_t span_ns = has_rows ? chunks_.back().last_time_ns - *first_time_ns_ : 0;
  end["duration_s"] = fmt::format("{:.9f}", 1e-9 * static_cast<double>(span_ns));
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
  while (error && !chunks_.empty() && writer_.drop_last_chunk()) {
    lost += chunks_.back().rows;
    rows_ -= chunks_.back().rows;
    chunks_.pop_back();
    end["rows_lost_at_the_end"] = std::to_string(lost);
    error = write_end(end);
  }
  if (error) return error;
  return writer_.file().sync();
}

}  // namespace hapticd::server
