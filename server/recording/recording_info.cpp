#include "server/recording/recording_info.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <filesystem>
#include <utility>

#include "hal/recording/mcap_reader.h"
#include "hal/recording/recording_names.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxName = 64;

template <class T>
T number_of(const recording::Texts& texts, const char* key) {
  T number{};
  if (const auto found = texts.find(key); found != texts.end()) {
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), number);
  }
  return number;
}

std::string text_of(const recording::Texts& texts, const char* key) {
  const auto found = texts.find(key);
  return found == texts.end() ? std::string() : found->second;
}

void take_start(recording::Texts start, RecordingInfo& info) {
  info.name = text_of(start, "name");
  info.note = text_of(start, "note");
  info.by = text_of(start, "by");
  info.started_unix_ns = number_of<std::int64_t>(start, "started_unix_ns");
  info.cause = text_of(start, "cause");
  info.cause_tick = number_of<std::uint64_t>(start, "cause_tick");
  info.start = std::move(start);
}

void take_end(const recording::Texts& end, RecordingInfo& info) {
  info.end_reason = text_of(end, "reason");
  info.rows = number_of<std::uint64_t>(end, "rows");
  info.lost_ticks = number_of<std::uint64_t>(end, "lost_ticks");
  info.cause_after_s = number_of<double>(end, "cause_after_s");
  if (end.contains("duration_s")) info.duration_s = number_of<double>(end, "duration_s");
  if (end.contains("repaired")) info.state = RecordingState::kRepaired;
}

}  // namespace

RecordingInfo read_info(const std::string& path) {
  RecordingInfo info;
  info.id = std::filesystem::path(path).stem().string();
  info.name = info.id;
  const auto reader = recording::McapReader::open(path, recording::Links::kRefused);
  if (!reader) {
    info.state = RecordingState::kForeign;
    info.end_reason = reader.error().what;
    return info;
  }
  info.bytes = reader->size();
  bool has_start = false;
  if (const auto content = reader->summary()) {
    // A file whose end does not say it: messages may be older than the first row.
    info.duration_s = 1e-9 * static_cast<double>(content->end_time_ns - content->start_time_ns);
    for (const recording::MetadataIndex& index : content->metadata) {
      const bool is_start = index.name == recording::kStartMetadata;
      if (!is_start && index.name != recording::kEndMetadata) continue;
      const auto texts = reader->metadata(index);
      if (!texts) continue;
      has_start = has_start || is_start;
      is_start ? take_start(*texts, info) : take_end(*texts, info);
    }
  } else {
    info.state = RecordingState::kUnfinished;
    recording::McapVisitor visitor;
    visitor.metadata = [&](const std::string& name, const recording::Texts& texts) {
      if (name == recording::kStartMetadata) {
        has_start = true;
        take_start(texts, info);
      }
    };
    visitor.message = [](const recording::Message&) { return false; };  // the start comes before all messages
    static_cast<void>(reader->read(visitor));
  }
  if (!has_start) {
    info.state = RecordingState::kForeign;
    info.end_reason = "not written by hapticd";
  }
  return info;
}

std::string file_id(std::uint64_t number, std::int64_t unix_ns, const std::string& name) {
  const std::time_t seconds = static_cast<std::time_t>(unix_ns / 1'000'000'000);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%SZ", &parts);
  std::string kept;
  for (const char c : name.substr(0, kMaxName)) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.';
    kept += plain ? c : '_';
  }
  return fmt::format("{:05}_{}_{}", number, text, kept.empty() ? "recording" : kept);
}

std::uint64_t number_of_id(const std::string& id) {
  constexpr std::size_t kMaxDigits = 15;  // room to count on
  const std::size_t digits = std::min(id.find_first_not_of("0123456789"), id.size());
  if (digits == 0 || digits > kMaxDigits || !id.substr(digits).starts_with('_')) return 0;
  return std::stoull(id.substr(0, digits));
}

}  // namespace hapticd::server
