#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "server/identification/recorded_observations.h"
#include "server/identification/sha256_stream.h"
#include "server/outcome.h"

namespace hapticd::server {

/// A recording that was uploaded; its file lives as long as anyone holds it.
struct ShelvedRecording {
  std::string id;  ///< "recording-3"
  std::filesystem::path path;
  RecordingDescription description;
  double normal_force_n = 0.0;  ///< where it was constant and not recorded; 0 = not told
  std::string sha256;           ///< of its text, hexadecimal
  std::uint64_t rows = 0;       ///< lines that are neither empty nor a comment, less the header
  ShelvedRecording() = default;
  ShelvedRecording(const ShelvedRecording&) = delete;
  ShelvedRecording& operator=(const ShelvedRecording&) = delete;
  ~ShelvedRecording();
};

/// Uploaded recordings, in a temporary folder of their own until the daemon ends. Any thread.
class RecordingShelf {
 public:
  static constexpr std::size_t kMostRecordings = 8;
  static constexpr std::uint64_t kMostBytes = 2ULL << 30;

  RecordingShelf() = default;
  ~RecordingShelf();
  RecordingShelf(const RecordingShelf&) = delete;
  RecordingShelf& operator=(const RecordingShelf&) = delete;

  /// One upload under way; dropped, it leaves nothing behind.
  class Upload {
   public:
    ~Upload();
    /// Appends; refused where it grows too large or the disk is full.
    std::optional<Refusal> append(std::string_view bytes);

   private:
    friend class RecordingShelf;
    Upload() = default;
    std::shared_ptr<ShelvedRecording> recording_;
    std::ofstream stream_;
    Sha256Stream digest_;
    std::uint64_t bytes_ = 0;
    char last_ = '\n';
    bool line_counts_ = false;
  };

  Outcome<std::unique_ptr<Upload>> begin(const RecordingDescription& description, double normal_force_n);
  /// Puts it on the shelf; the oldest makes room.
  Outcome<std::shared_ptr<const ShelvedRecording>> finish(std::unique_ptr<Upload> upload);
  Outcome<std::shared_ptr<const ShelvedRecording>> find(const std::string& id) const;

 private:
  std::optional<Refusal> make_folder();

  mutable std::mutex mutex_;
  std::filesystem::path folder_;
  std::uint64_t uploads_ = 0;
  std::deque<std::shared_ptr<const ShelvedRecording>> shelf_;
};

}  // namespace hapticd::server
