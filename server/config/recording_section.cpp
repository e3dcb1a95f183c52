#include "server/config/recording_section.h"

#include <fmt/format.h>

#include "server/text/range.h"
#include "server/text/toml_text.h"

namespace hapticd::server {

namespace {

constexpr Range kQuotaMb{1.0, 1e8, "MB"};
constexpr Range kKeepFreeMb{0.0, 1e8, "MB"};
constexpr Word<WhenFull> kWhenFullWords[] = {{"stop", WhenFull::kStop},
                                             {"remove_oldest", WhenFull::kRemoveOldest}};

}  // namespace

void read_recording(TomlTable table, RecordingConfig& recording) {
  table.read("folder", recording.folder, 4096);
  table.read("quota_mb", recording.quota_mb, kQuotaMb);
  table.read("when_full", recording.when_full, kWhenFullWords);
  table.read("keep_free_mb", recording.keep_free_mb, kKeepFreeMb);
  table.read("flight_recorder", recording.flight_recorder);
  table.read("ring_folder", recording.ring_folder, 4096);
  table.read("incident_quota_mb", recording.incident_quota_mb, kQuotaMb);
}

std::string write_recording(const RecordingConfig& recording) {
  return fmt::format(
      "\n[recording]\nfolder = {}\nquota_mb = {}\nwhen_full = {}\nkeep_free_mb = {}\nflight_recorder = {}\n"
      "ring_folder = {}\nincident_quota_mb = {}\n",
      toml_quoted(recording.folder), toml_number(recording.quota_mb),
      toml_quoted(text_of(recording.when_full, kWhenFullWords)), toml_number(recording.keep_free_mb),
      recording.flight_recorder, toml_quoted(recording.ring_folder),
      toml_number(recording.incident_quota_mb));
}

}  // namespace hapticd::server
