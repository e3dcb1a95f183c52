#include "tests/measure/study/common/recording_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <system_error>

namespace hapticd::study {
namespace {

constexpr const char* kVariable = "HAPTICD_RECORDINGS";
constexpr const char* kNanoindentation = "nanoindentation";

/// A cantilever's world in the hand's: 0.1 µN reads as 1 N and 1 µm as 1 mm. The contact threshold of 15 mN
/// stands for 1.5 nN then, five times the cantilever's noise, and the peak of 49 nN reads as 0.49 N.
void scale_nanoindentation(RecordingEntry& entry) {
  entry.config.force.scale = 1e7;
  entry.config.position.scale = 1e3;
  entry.config.bias_s = 1.0;  // the tool is free then
}

}  // namespace

std::optional<std::filesystem::path> recordings_folder() {
  const char* named = std::getenv(kVariable);
  if (named == nullptr || *named == '\0') return std::nullopt;
  std::error_code ignored;
  if (!std::filesystem::is_directory(named, ignored)) return std::nullopt;
  return named;
}

std::string no_recordings_reason() {
  const char* named = std::getenv(kVariable);
  if (named == nullptr || *named == '\0') {
    return fmt::format("{} is not set; it names the folder of the recordings", kVariable);
  }
  return fmt::format("{} names no folder with recordings: '{}'", kVariable, named);
}

std::vector<RecordingEntry> recordings_of(const std::filesystem::path& folder, const std::string& set) {
  std::vector<RecordingEntry> entries;
  std::error_code ignored;
  for (const auto& file : std::filesystem::directory_iterator(folder / set, ignored)) {
    if (file.path().extension() != ".csv") continue;
    RecordingEntry entry{.name = set + "/" + file.path().stem().string(), .set = set};
    entry.config.path = file.path().string();
    if (set == kNanoindentation) scale_nanoindentation(entry);
    entries.push_back(std::move(entry));
  }
  // By name, and cycle_3 before cycle_10.
  std::sort(entries.begin(), entries.end(), [](const RecordingEntry& a, const RecordingEntry& b) {
    return a.name.size() != b.name.size() ? a.name.size() < b.name.size() : a.name < b.name;
  });
  return entries;
}

}  // namespace hapticd::study
