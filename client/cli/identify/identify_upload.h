#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "client/cpp/client.h"

namespace hapticd::cli {

/// How far an upload is.
struct UploadState {
  std::uint64_t sent_bytes = 0;
  std::optional<std::uint64_t> total_bytes;  ///< absent for what has no length, e.g. a pipe
  bool sent = false;                         ///< all of it; the daemon reads it
  std::chrono::duration<double> elapsed{};   ///< since its beginning; of what was sent, until all was

  /// Mean so far; 0 before there is one.
  double mb_per_s() const;
};

struct UploadOptions {
  /// The upload ends when the daemon takes nothing for so long. Reading what was sent may take a second
  /// longer for each 4 MiB.
  std::chrono::milliseconds timeout{5000};
  /// Called at least ten times a second.
  std::function<void(const UploadState&)> on_progress{};
  /// Asked equally often: true ends the upload.
  std::function<bool()> interrupted{};
};

/// Sends a file of any size, piece by piece. Throws LocalError when it cannot be read, is empty or was
/// interrupted, client::Error when the daemon refuses it (naming line and column) or is lost.
v1::UploadRecordingResponse upload_file(client::Client& client, const std::string& path,
                                        const v1::RecordingDescription& description,
                                        const UploadOptions& options);

/// Name of a recording, after the name of its file: at most 200 characters, without bytes that are not text.
std::string recording_name(const std::string& path);

}  // namespace hapticd::cli
