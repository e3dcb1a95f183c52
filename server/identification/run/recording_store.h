#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "hal/lock/mutex.h"
#include "server/identification/run/recorded_observations.h"
#include "server/identification/run/sha256_stream.h"
#include "server/identification/run/unnamed_file.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Recording that was uploaded; its file lives as long as anything holds it, and not beyond the process.
struct StoredRecording {
  explicit StoredRecording(UnnamedFile text) : file(std::move(text)) {}

  std::string id;  ///< "recording-3"
  UnnamedFile file;
  RecordingDescription description;
  double normal_force_n = 0.0;  ///< if it was constant and not recorded; 0 = not reported
  std::string sha256;           ///< of its text, hexadecimal
  std::uint64_t rows = 0;       ///< of CSV: lines that are neither empty nor a comment, less the header
};

/// Uploaded recordings, in temporary files without names until the daemon ends, however it ends. Any thread.
class RecordingStore {
 public:
  static constexpr std::size_t kMaxRecordings = 8;
  static constexpr std::uint64_t kMaxBytes = 2ULL << 30;

  /// Upload under way; dropped, it leaves nothing behind.
  class Upload {
   public:
    /// Appends; refused if it grows too large or leaves too little of the disk.
    std::optional<Refusal> append(std::string_view bytes);

   private:
    friend class RecordingStore;
    Upload(UnnamedFile file, double keep_free_mb)
        : recording_(std::make_shared<StoredRecording>(std::move(file))), keep_free_mb_(keep_free_mb) {}
    std::shared_ptr<StoredRecording> recording_;
    const double keep_free_mb_;
    Sha256Stream digest_;
    std::uint64_t bytes_ = 0;
    char last_ = '\n';
    bool line_counts_ = false;
  };

  /// Sets what is to stay free of the disk of $TMPDIR. Call it before the first upload.
  void keep_free(double mb) { keep_free_mb_ = mb; }
  double keep_free_mb() const { return keep_free_mb_; }
  Outcome<std::unique_ptr<Upload>> begin(const RecordingDescription& description, double normal_force_n);
  /// Puts it into the store of recordings; the oldest makes room.
  Outcome<std::shared_ptr<const StoredRecording>> finish(std::unique_ptr<Upload> upload);
  Outcome<std::shared_ptr<const StoredRecording>> find(const std::string& id) const;

 private:
  double keep_free_mb_ = 0.0;
  mutable Mutex mutex_;
  std::uint64_t uploads_ GUARDED_BY(mutex_) = 0;
  std::deque<std::shared_ptr<const StoredRecording>> recordings_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
