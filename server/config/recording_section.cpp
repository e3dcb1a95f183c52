#include "server/config/recording_section.h"

#include "server/text/toml_writer.h"

namespace hapticd::server {

namespace {

constexpr Range kQuotaMb{1.0, 1e8, "MB"};
constexpr Range kKeepFreeMb{0.0, 1e8, "MB"};
constexpr Word<WhenFull> kWhenFullWords[] = {{"stop", WhenFull::kStop},
                                             {"remove_oldest", WhenFull::kRemoveOldest}};

void recording_fields(auto& table, auto& recording) {
  table.field("folder", recording.folder, 4096);
  table.field("quota_mb", recording.quota_mb, kQuotaMb);
  table.field("when_full", recording.when_full, kWhenFullWords);
  table.field("keep_free_mb", recording.keep_free_mb, kKeepFreeMb);
  table.field("flight_recorder", recording.flight_recorder);
  table.field("ring_folder", recording.ring_folder, 4096);
  table.field("incident_quota_mb", recording.incident_quota_mb, kQuotaMb);
}

}  // namespace

void read_recording(TomlTable table, RecordingConfig& recording) {
  recording_fields(table, recording);
}

std::string write_recording(const RecordingConfig& recording) {
  return toml_fields([&](TomlWriter& root) {
    TomlWriter table = root.table("recording");
    recording_fields(table, recording);
  });
}

}  // namespace hapticd::server
