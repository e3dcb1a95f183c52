#include "server/recording/recording_folder.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <utility>

#include "hal/recording/free_disk.h"
#include "hal/recording/recording_file.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;
constexpr const char* kEnding = ".mcap";
constexpr double kMb = 1e6;

/// "stopped" of "00007_20260102T030405Z_stopped".
std::string name_of_id(const std::string& id) {
  const std::size_t end_of_time = id.find("Z_");
  return end_of_time == std::string::npos ? std::string() : id.substr(end_of_time + 2);
}

}  // namespace

std::optional<hal::Error> RecordingFolder::open() const {
  std::error_code failure;
  fs::create_directories(path_, failure);
  if (!failure && access(path_.c_str(), W_OK | X_OK) == 0) return std::nullopt;
  const std::string why = failure ? failure.message() : std::strerror(errno);
  return hal::Error{"the folder of recordings cannot be written to", path_, why,
                    "a folder that hapticd may write to",
                    "see its owner and rights, or name another one: [recording] folder"};
}

std::vector<RecordingFolder::File> RecordingFolder::files() const {
  std::vector<File> found;
  std::error_code failure;
  for (const auto& entry : fs::directory_iterator(path_, failure)) {
    std::error_code ignored;
    // What a link leads to is none of the recordings.
    if (entry.path().extension() != kEnding || !fs::is_regular_file(entry.symlink_status(ignored))) continue;
    const auto bytes = entry.file_size(ignored);
    found.push_back({entry.path().stem().string(), ignored ? 0 : bytes});
  }
  // By the number, not by the time behind it: a clock may be set back.
  std::sort(found.begin(), found.end(), [](const File& a, const File& b) {
    return std::pair(number_of_id(a.id), a.id) < std::pair(number_of_id(b.id), b.id);
  });
  return found;
}

std::vector<std::string> RecordingFolder::ids() const {
  std::vector<std::string> names;
  for (const File& file : files()) names.push_back(file.id);
  return names;
}

std::vector<std::string> RecordingFolder::repair_all() const {
  std::vector<std::string> lines;
  for (const File& file : files()) {
    const std::string path = path_ + "/" + file.id + kEnding;
    if (const auto reader = recording::McapReader::open(path, recording::Links::kRefused);
        !reader || reader->summary())
      continue;
    const auto repaired = recording::repair(path);
    if (!repaired)
      lines.push_back("recording '" + file.id + "' cannot be repaired: " + repaired.error().text());
    if (repaired && *repaired) {
      lines.push_back("recording '" + file.id + "' was not finished by an earlier run, and is now");
    }
  }
  return lines;
}

std::vector<RecordingInfo> RecordingFolder::list() const {
  std::vector<RecordingInfo> list;
  for (const File& file : files()) {
    RecordingInfo info = read_info(path_ + "/" + file.id + kEnding);
    info.bytes = file.bytes;
    list.push_back(std::move(info));
  }
  return list;
}

std::optional<std::string> RecordingFolder::find(const std::string& id) const {
  for (const File& file : files()) {
    if (file.id == id) return path_ + "/" + id + kEnding;
  }
  return std::nullopt;
}

std::string RecordingFolder::new_path(std::int64_t unix_ns, const std::string& name) const {
  const std::vector<File> all = files();
  const std::uint64_t number = all.empty() ? 1 : number_of_id(all.back().id) + 1;
  return path_ + "/" + file_id(number, unix_ns, name) + kEnding;
}

std::optional<hal::Error> RecordingFolder::remove(const std::string& id) const {
  const auto path = find(id);
  if (path && unlink(path->c_str()) == 0) return std::nullopt;
  return hal::Error{"the recording cannot be deleted", path.value_or(id), std::strerror(errno), "",
                    "see the owner and the rights of its folder"};
}

double RecordingFolder::used_mb() const {
  double used_mb = 0.0;
  for (const File& file : files()) used_mb += static_cast<double>(file.bytes) / kMb;
  return used_mb;
}

std::optional<hal::Error> RecordingFolder::make_room(const std::string& kept, double first_mb) const {
  std::vector<File> all = files();
  double used_mb = this->used_mb();
  const auto goes_first = [&](const std::string& id) {
    return !limits_.goes_first.empty() && name_of_id(id) == limits_.goes_first;
  };
  const auto next_to_go = [&] {
    std::map<std::string, std::uint64_t> taken;  // bytes, by name
    const auto weight = [&](const File& file) -> std::uint64_t& {
      return taken[limits_.goes_first.empty() ? "" : name_of_id(file.id)];
    };
    for (const File& file : all) weight(file) += file.bytes;
    if (!limits_.goes_first.empty()) taken[limits_.goes_first] = UINT64_MAX;
    auto chosen = all.end();
    for (auto file = all.begin(); file != all.end(); ++file) {
      if (file->id == kept || (goes_first(kept) && !goes_first(file->id))) continue;
      if (chosen == all.end() || weight(*file) > weight(*chosen)) chosen = file;
    }
    return chosen;
  };
  const auto remove_oldest = [&] {
    const auto oldest = next_to_go();
    if (limits_.when_full != WhenFull::kRemoveOldest || oldest == all.end()) return false;
    if (remove(oldest->id)) return false;
    used_mb -= static_cast<double>(oldest->bytes) / kMb;
    all.erase(oldest);
    return true;
  };
  const std::string first =
      first_mb > 0.0 ? fmt::format(", and {:.2f} MB for the first seconds", first_mb) : std::string();
  const bool ever_fits = first_mb <= limits_.quota_mb;  // else none is deleted for it
  while (used_mb + first_mb > limits_.quota_mb) {
    if (ever_fits && remove_oldest()) continue;
    const bool alone = !ever_fits || next_to_go() == all.end();
    return hal::Error::of(
        hal::ErrorCode::kFull,
        alone ? "the quota is too small for this recording" : "the quota of recordings is used up",
        limits_.quota_key, fmt::format("{:.1f} MB in {}{}", used_mb, path_, first),
        fmt::format("{:g} MB", limits_.quota_mb),
        alone ? "raise it, or record fewer groups, fewer ticks or for a shorter time"
              : "delete recordings (hapticctl record delete), raise it, or set when_full = "
                "\"remove_oldest\"");
  }
  while (limits_.keep_free_mb + first_mb > 0.0) {
    const double free_mb = recording::free_disk_mb(path_);
    if (free_mb >= limits_.keep_free_mb + first_mb) break;
    if (remove_oldest()) continue;
    return hal::Error::of(
        hal::ErrorCode::kFull, "the disk is nearly full", path_, fmt::format("{:.1f} MB are free", free_mb),
        fmt::format("[recording] keep_free_mb = {:g}{}", limits_.keep_free_mb, first),
        limits_.keep_free_mb > 0.0 ? "make room there, or keep less free" : "make room there");
  }
  return std::nullopt;
}

}  // namespace hapticd::server
