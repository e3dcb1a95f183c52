#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/recording/column_table.h"
#include "server/recording/event_log.h"
#include "server/recording/record_monitor.h"
#include "server/recording/recording_output.h"
#include "server/session/outcome.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

struct RunOptions {
  std::string path;
  std::string id;
  std::uint32_t channels = 0;    ///< bits of rt::channel
  std::uint32_t decimation = 1;  ///< every n-th tick
  recording::Texts start;        ///< kStartMetadata
  /// Asked once a second: why the recording must end; nothing while it may go on.
  Callback<std::optional<hal::Error>()> must_end = [] { return std::nullopt; };
};

struct RunReport {
  bool is_running = true;
  std::uint64_t rows = 0;
  std::uint64_t lost_ticks = 0;
  std::uint64_t bytes = 0;
  double duration_s = 0.0;
  std::string end_reason;           ///< empty while it runs
  std::optional<hal::Error> error;  ///< what ended it against its will
  double longest_sync_s = 0.0;
};

/// Refusal of a recording that cannot be written; a disk or a quota that is full is told apart.
Refusal cannot_record(hal::Error error);

/// One recording, from start to end: a subscriber of the telemetry hub with a queue of 20 s, a thread that
/// writes a chunk every half second, and one that has them written to the disk every second. A disk that
/// stalls delays neither the loop nor other subscribers; ticks that were lost are an event in the file.
class RecordingRun {
 public:
  static constexpr double kQueueS = 20.0;
  static constexpr std::chrono::milliseconds kChunkTime{500};
  static constexpr std::chrono::milliseconds kSyncTime{1000};

  /// Begins one; if it cannot, nothing of it is left.
  static Outcome<std::unique_ptr<RecordingRun>> start(TelemetryHub& hub, EventLog& event_log,
                                                      const RecordingSources& sources, RunOptions options);
  /// Ends it.
  ~RecordingRun();
  RecordingRun(const RecordingRun&) = delete;
  RecordingRun& operator=(const RecordingRun&) = delete;

  /// Returns when the file is finished: with all ticks until now.
  void end(const std::string& reason);
  RunReport report() const;
  const std::string& id() const { return options_.id; }
  const recording::Texts& start_texts() const { return options_.start; }

 private:
  using Clock = std::chrono::steady_clock;
  RecordingRun(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources, RunOptions options,
               RecordingOutput output);
  /// Starts its threads; an error, and none of them, if the machine gives too few.
  std::optional<hal::Error> begin();
  void run();
  void run_sync();
  void take_records();
  void take_events();
  void flush_rows();
  void add_event(recording::Event event);
  void note_loss(const rt::TickRecord& next);
  /// Notes an event if the machine's clock was set.
  void note_clock();
  std::optional<hal::Error> write_due(Clock::time_point now);
  void publish(const std::optional<hal::Error>& error, const std::string& reason);
  void finish(const std::optional<hal::Error>& error);

  TelemetryHub& hub_;
  EventLog& event_log_;
  const RecordingSources& sources_;
  const RunOptions options_;
  const ColumnTable table_;
  const std::shared_ptr<Subscription> subscription_;

  // The writing thread's own.
  RecordingOutput output_;
  RecordMonitor watch_;
  std::string rows_;
  std::optional<std::uint64_t> last_tick_;
  std::int64_t first_time_ns_ = 0;
  std::int64_t last_time_ns_ = 0;
  std::uint64_t lost_ticks_ = 0;
  std::uint64_t event_number_;
  std::uint64_t missed_events_ = 0;
  bool scene_changed_ = true;
  std::int64_t utc_offset_ns_ = 0;  ///< CLOCK_REALTIME against CLOCK_MONOTONIC, a second ago
  Clock::time_point chunk_due_{};
  Clock::time_point end_due_{};
  Clock::time_point anchor_due_{};

  mutable Mutex mutex_;
  Condition signal_;
  bool ending_ GUARDED_BY(mutex_) = false;
  std::string wanted_reason_ GUARDED_BY(mutex_);
  RunReport report_ GUARDED_BY(mutex_);
  std::optional<hal::Error> sync_error_ GUARDED_BY(mutex_);
  std::thread sync_thread_;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
