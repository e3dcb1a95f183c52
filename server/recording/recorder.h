#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/recording/event_log.h"
#include "server/recording/recording_folder.h"
#include "server/recording/recording_info.h"
#include "server/recording/recording_run.h"
#include "server/recording/recording_sources.h"
#include "server/session/outcome.h"

namespace hapticd::server {

struct RecordingRequest {
  std::string name;
  std::string note;
  std::string by;                ///< identity of the client
  std::uint32_t channels = 0;    ///< bits of rt::channel; 0 = all that the rig has
  std::uint32_t decimation = 1;  ///< 1 … 10000
  /// Asked once a second: why the recording is over, without having been stopped; nothing while it goes on.
  Callback<std::optional<hal::Error>()> is_over = [] { return std::nullopt; };
};

/// Recordings of the daemon: one at a time runs, those that are finished are kept in a folder. Belongs to the
/// daemon, not to the client that started it. Any thread.
class Recorder {
 public:
  static constexpr std::size_t kMaxText = 4096;

  /// `folder`: empty if nothing can be recorded. All must outlive it.
  Recorder(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources,
           const RecordingConfig& config);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Makes the folder and repairs what an earlier run left unfinished. An error: nothing can be recorded, and
  /// why; the daemon goes on.
  std::optional<hal::Error> open();

  /// Reason why nothing can be recorded; nothing if it can.
  std::optional<Refusal> unavailable() const;
  /// Folder in which recordings are kept, and how much is there.
  const RecordingFolder& folder() const { return folder_; }

  Outcome<RecordingInfo> start(const RecordingRequest& request);
  /// Returns when the file is finished.
  Outcome<RecordingInfo> stop(const std::string& by);
  /// Puts a note in what is recorded now.
  std::optional<Refusal> annotate(const std::string& text, const std::string& by);
  /// Lists recordings, oldest first, the one that runs last.
  Outcome<std::vector<RecordingInfo>> list() const;
  /// Path of one that is finished.
  Outcome<std::string> path_of(const std::string& id) const;
  Outcome<RecordingInfo> remove(const std::string& id);
  /// Recording that runs, if one does.
  std::optional<RecordingInfo> running() const;
  /// Ends the one that runs; no other begins.
  void shutdown();

 private:
  RecordingInfo info_of(const RecordingRun& run) const;
  /// Recording that was started last, unless it has ended.
  std::shared_ptr<RecordingRun> current() const;
  void replace_current(std::shared_ptr<RecordingRun> run);

  TelemetryHub& hub_;
  EventLog& event_log_;
  const RecordingSources& sources_;
  const RecordingFolder folder_;
  const bool has_folder_;
  std::optional<hal::Error> problem_;  ///< of the folder

  SerialMutex changes_;  ///< of start, stop and shutdown, which wait for the disk
  bool ending_ GUARDED_BY(changes_) = false;
  mutable Mutex current_mutex_;  ///< held only briefly
  std::shared_ptr<RecordingRun> run_ GUARDED_BY(current_mutex_);
};

/// Refusal when there is no recording of this name; those that are there are listed.
Refusal no_such_recording(const std::string& id, const std::vector<std::string>& ids);

}  // namespace hapticd::server
