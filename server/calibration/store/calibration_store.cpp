#include "server/calibration/store/calibration_store.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "hal/recording/append_file.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMinDigits = 6;
constexpr const char* kAdopted = "adopted";

/// Some times the size of the largest calibration.
constexpr std::uintmax_t kMaxBytes = std::uintmax_t{1} << 20U;

/// Text of a file; empty for one that is too large, and for a link or a device.
std::string text_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(path, error)) || fs::file_size(path, error) > kMaxBytes)
    return {};
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

CalibrationStore::CalibrationStore(std::string folder, std::string rig)
    : folder_(std::move(folder)), rig_(std::move(rig)) {
  if (folder_.empty()) return;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder_, error)) {
    if (entry.path().extension() != ".json") continue;
    auto read = read_calibration(text_of(entry.path()));
    if (read && read->hash == entry.path().stem().string()) all_.push_back(std::move(*read));
  }
  std::sort(all_.begin(), all_.end(), [](const auto& a, const auto& b) { return a.created < b.created; });
  std::string hash = text_of(fs::path(folder_) / kAdopted);
  hash.erase(std::remove_if(hash.begin(), hash.end(), [](unsigned char c) { return std::isspace(c) != 0; }),
             hash.end());
  if (hash.empty()) return;
  if (const auto found = find_locked(hash); found && found->rig == rig_) {
    adopted_hash_ = found->hash;
    adopted_.set(std::make_shared<const calibration::ArmCalibration>(found->fit.calibration));
  }
}

// Writes to a file of another name first: a crash leaves the old one or the new one.
std::optional<Refusal> CalibrationStore::write(const std::string& name, const std::string& text) const {
  if (folder_.empty()) return std::nullopt;
  std::error_code error;
  fs::create_directories(folder_, error);
  const fs::path path = fs::path(folder_) / name;
  const fs::path draft = path.string() + ".new";
  {
    auto file = recording::AppendFile::open_or_create(draft.string());
    auto failed = file ? file->truncate(0) : std::optional(file.error());
    if (!failed) failed = file->append(text);
    if (failed) {
      failed->what = "a calibration cannot be written: " + failed->what;
      return Refusal{RefusalKind::kInternal, std::move(*failed)};
    }
  }
  fs::rename(draft, path, error);
  if (!error) return std::nullopt;
  return Refusal{RefusalKind::kInternal,
                 {"a calibration cannot be written", path.string(), error.message(), "",
                  "make room on the disk, or change who may write there"}};
}

Outcome<StoredCalibration> CalibrationStore::keep(StoredCalibration made) {
  const std::string text = calibration_text(made);
  auto stored = read_calibration(text);
  if (!stored) return Refusal{RefusalKind::kInternal, stored.error()};
  const MutexLock lock(mutex_);
  if (auto refusal = write(stored->hash + ".json", text)) return *refusal;
  all_.push_back(*stored);
  return *stored;
}

std::vector<StoredCalibration> CalibrationStore::list() const {
  const MutexLock lock(mutex_);
  return {all_.rbegin(), all_.rend()};
}

Outcome<StoredCalibration> CalibrationStore::find_locked(const std::string& hash) const {
  std::vector<const StoredCalibration*> found;
  for (const StoredCalibration& c : all_) {
    if (hash.size() >= kMinDigits && c.hash.starts_with(hash)) found.push_back(&c);
  }
  if (found.size() == 1) return *found.front();
  return Refusal{RefusalKind::kNotFound,
                 {found.empty() ? "there is no such calibration" : "several calibrations begin like this",
                  "calibrations", hash, "a hash, or at least six of its first digits",
                  "see 'hapticctl calibration list'"}};
}

Outcome<StoredCalibration> CalibrationStore::find(const std::string& hash) const {
  const MutexLock lock(mutex_);
  return find_locked(hash);
}

Outcome<std::string> CalibrationStore::adopt(const std::string& hash) {
  const MutexLock lock(mutex_);
  std::shared_ptr<const calibration::ArmCalibration> value;
  std::string whole;
  if (!hash.empty()) {
    auto found = find_locked(hash);
    if (!found) return found.refusal();
    if (found->kind == calibration::CalibrationKind::kTip) {
      return Refusal{RefusalKind::kFailedPrecondition,
                     {"a tip calibration corrects nothing by itself", "calibrations", found->hash,
                      "a registration or kinematics",
                      "use it as --tip of 'hapticctl calibrate registration' or 'kinematics'"}};
    }
    if (found->rig != rig_) {
      return Refusal{
          RefusalKind::kFailedPrecondition,
          {"the calibration is of another rig", "calibrations", found->rig, rig_, "calibrate this rig"}};
    }
    whole = found->hash;
    value = std::make_shared<const calibration::ArmCalibration>(found->fit.calibration);
  }
  if (auto refusal = write(kAdopted, whole)) return *refusal;
  adopted_hash_ = whole;
  adopted_.set(std::move(value));
  return whole;
}

std::optional<Refusal> CalibrationStore::remove(const std::string& hash) {
  const MutexLock lock(mutex_);
  auto found = find_locked(hash);
  if (!found) return found.refusal();
  if (found->hash == adopted_hash_) {
    return Refusal{
        RefusalKind::kFailedPrecondition,
        {"the calibration is adopted", "calibrations", found->hash, "", "adopt another one, or none"},
        Reason::kInUse};
  }
  if (!folder_.empty()) {
    std::error_code error;
    fs::remove(fs::path(folder_) / (found->hash + ".json"), error);
    if (error) {
      return Refusal{
          RefusalKind::kInternal,
          {"a calibration cannot be deleted", folder_, error.message(), "", "change who may write there"}};
    }
  }
  std::erase_if(all_, [&](const StoredCalibration& c) { return c.hash == found->hash; });
  return std::nullopt;
}

std::string CalibrationStore::adopted_hash() const {
  const MutexLock lock(mutex_);
  return adopted_hash_;
}

}  // namespace hapticd::server
