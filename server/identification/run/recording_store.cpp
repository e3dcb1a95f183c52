#include "server/identification/run/recording_store.h"

#include <fmt/format.h>

#include <utility>

#include "hal/recording/free_disk.h"
#include "hal/replay/table_file.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

Refusal cannot_keep(const hal::Error& error) {
  return {RefusalKind::kResourceExhausted,
          {"the recording cannot be kept: " + error.what, error.where, error.value, error.limit,
           "make room there, or set TMPDIR to a folder that has some"}};
}

}  // namespace

std::optional<Refusal> RecordingStore::Upload::append(std::string_view bytes) {
  bytes_ += bytes.size();
  if (bytes_ > kMaxBytes) {
    return Refusal{RefusalKind::kResourceExhausted,
                   {"the recording is too large", recording_->description.name,
                    fmt::format("more than {} bytes", kMaxBytes), fmt::format("up to {} bytes", kMaxBytes),
                    "cut it, or leave out columns that are not needed"}};
  }
  const std::string& folder = recording_->file.folder();
  if (const double free_mb = recording::free_disk_mb(folder); free_mb < keep_free_mb_) {
    return cannot_keep({"the disk is nearly full", folder, fmt::format("{:.1f} MB are free", free_mb),
                        fmt::format("{:g} MB stay free", keep_free_mb_), ""});
  }
  if (const auto error = recording_->file.append(bytes)) return cannot_keep(*error);
  digest_.add(bytes);
  for (const char c : bytes) {
    if (last_ == '\n') line_counts_ = c != '#' && c != '\n' && c != '\r';
    if (c == '\n' && line_counts_) ++recording_->rows;
    last_ = c;
  }
  return std::nullopt;
}

Outcome<std::unique_ptr<RecordingStore::Upload>> RecordingStore::begin(
    const RecordingDescription& description, double normal_force_n) {
  auto file = UnnamedFile::create();
  if (!file) return cannot_keep(file.error());
  std::unique_ptr<Upload> upload(new Upload(std::move(*file), keep_free_mb_));
  StoredRecording& recording = *upload->recording_;
  {
    const MutexLock lock(mutex_);
    recording.id = fmt::format("recording-{}", ++uploads_);
  }
  recording.description = description;
  recording.normal_force_n = normal_force_n;
  if (recording.description.name.empty()) recording.description.name = recording.id;
  return upload;
}

Outcome<std::shared_ptr<const StoredRecording>> RecordingStore::finish(std::unique_ptr<Upload> upload) {
  StoredRecording& recording = *upload->recording_;
  if (replay::is_hdf5(recording.file.path())) {
    return Refusal{RefusalKind::kInvalidArgument, replay::hdf5_is_not_read(recording.description.name)};
  }
  if (const auto rows = replay::rows_of_mcap(recording.file.path())) {
    recording.rows = *rows;
  } else {
    if (upload->last_ != '\n' && upload->line_counts_) ++recording.rows;
    if (recording.rows > 0) --recording.rows;  // the header
  }
  if (recording.rows == 0) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"the recording is empty", recording.description.name, "",
         "a header line with the columns' names, then rows of numbers", "send a CSV or MCAP file"}};
  }
  recording.sha256 = upload->digest_.finish();
  const MutexLock lock(mutex_);
  recordings_.push_back(upload->recording_);
  if (recordings_.size() > kMaxRecordings) recordings_.pop_front();
  return recordings_.back();
}

Outcome<std::shared_ptr<const StoredRecording>> RecordingStore::find(const std::string& id) const {
  const MutexLock lock(mutex_);
  std::vector<std::string> ids;
  for (const auto& recording : recordings_) {
    if (recording->id == id) return recording;
    ids.push_back(recording->id);
  }
  return Refusal{RefusalKind::kNotFound,
                 {"no such recording", "StartIdentificationRequest.recording", id, comma_separated(ids),
                  ids.empty() ? "upload it first" : did_you_mean(id, ids, "upload it again")}};
}

}  // namespace hapticd::server
