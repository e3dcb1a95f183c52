#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/lock/mutex.h"
#include "server/config/recording_section.h"
#include "server/recording/column_table.h"
#include "server/recording/event_log.h"
#include "server/recording/flight/flight_ring.h"
#include "server/recording/flight/incident.h"
#include "server/recording/record_monitor.h"
#include "server/recording/recording_folder.h"
#include "server/session/outcome.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

/// Keeps the last 30 s of every tick, always, in a file that survives the daemon. What happened around a
/// latched fault, a stop, an overrun or a request becomes an incident: a recording of 20 s before and 2 s
/// after. So do the last 30 s of a run that ended in no orderly way, when the next begins. A fault that ends
/// by itself, and an overrun, makes an incident at most every ten minutes. Any thread.
class FlightRecorder {
 public:
  static constexpr double kRingS = 30.0;
  static constexpr double kBeforeS = 20.0;
  static constexpr double kAfterS = 2.0;
  /// Requests that may wait for the ring's thread, which takes them every 20 ms.
  static constexpr std::size_t kMaxRequests = 64;
  /// Events that are kept for the next incident, the newest ones: as many as the event log has.
  static constexpr std::size_t kMaxEvents = EventLog::kKept + EventLog::kKeptOfFrequent;
  /// Bytes of an incident's words beyond which causes that follow are only counted.
  static constexpr std::size_t kMaxWords = 4096;

  FlightRecorder(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources,
                 const RecordingConfig& config);
  /// Shuts down.
  ~FlightRecorder();
  FlightRecorder(const FlightRecorder&) = delete;
  FlightRecorder& operator=(const FlightRecorder&) = delete;

  /// Begins. An error: it is off, and why; the daemon goes on.
  std::optional<hal::Error> open();
  /// Reason why it keeps nothing; nothing if it does.
  std::optional<Refusal> unavailable() const;
  const RecordingFolder& folder() const { return folder_; }
  bool is_on() const { return is_on_.load(); }
  /// Rows since the start; the newest of them are in the ring.
  std::uint64_t rows_kept() const { return rows_kept_.load(); }
  std::uint64_t incidents_written() const { return incidents_written_.load(); }
  /// Ends before the daemon's own last stop: no incident begins any more. Returns at once.
  void end() { ends_.store(true); }
  /// Writes what is under way, and deletes the ring: the run ended in order.
  void shutdown();

  /// Requests an incident of this moment. RESOURCE_EXHAUSTED beyond kMaxRequests.
  std::optional<Refusal> request(const std::string& reason, const std::string& by);
  Outcome<std::vector<RecordingInfo>> list() const;
  Outcome<std::string> path_of(const std::string& id) const;
  Outcome<RecordingInfo> remove(const std::string& id);
  struct Last {
    std::string id;
    std::string words;
  };
  /// The newest incident.
  std::optional<Last> last() const;

 private:
  using Clock = std::chrono::steady_clock;
  /// One whose last ticks are still to come.
  struct Pending {
    Incident incident;
    std::uint64_t due_tick = 0;
    std::uint64_t latest_tick = 0;
    std::uint64_t unnamed = 0;  ///< causes that its words only count
  };

  void keep_left_rings();
  void run();
  void run_writer();
  void take_records();
  void look_at(const WatchedEvent& watched);
  void begin_incident(Incident incident);
  void finish_pending(bool now);
  void note_scene();
  void write(const Incident& incident, const FlightRing& ring, const FlightRing::Notes& notes);
  Incident incident_of(const recording::Event& event, const std::string& cause) const;

  TelemetryHub& hub_;
  EventLog& event_log_;
  const RecordingSources& sources_;
  const RecordingConfig config_;
  const RecordingFolder folder_;
  const ColumnTable table_;
  std::optional<hal::Error> problem_;  ///< why it is off
  std::shared_ptr<Subscription> subscription_;
  std::unique_ptr<FlightRing> ring_;
  std::vector<std::string> left_;  ///< paths of rings of earlier runs

  // The ring thread's own.
  RecordMonitor watch_;
  std::string rows_;
  std::uint64_t last_tick_ = 0;
  std::int64_t last_time_ns_ = 0;
  Clock::time_point last_record_{};
  std::uint64_t first_looks_ = 0;
  std::uint64_t event_number_ = 0;
  bool scene_changed_ = true;
  bool write_failed_ = false;
  FlightRing::Notes notes_;
  std::deque<recording::Event> events_;   ///< of the last 30 s, at most kMaxEvents
  std::int64_t left_out_ns_ = INT64_MIN;  ///< time of the newest one that found no room
  std::optional<Pending> pending_;
  std::map<std::string, std::int64_t> quiet_until_ns_;  ///< by cause
  Clock::time_point anchor_due_{};

  std::atomic<bool> ends_{false};
  std::atomic<bool> is_on_{false};
  std::atomic<std::uint64_t> rows_kept_{0};
  std::atomic<std::uint64_t> incidents_written_{0};
  mutable Mutex mutex_;
  Condition signal_;
  bool ending_ GUARDED_BY(mutex_) = false;
  bool ring_ended_ GUARDED_BY(mutex_) = false;
  std::deque<recording::Event> requests_ GUARDED_BY(mutex_);
  struct Order {
    Incident incident;
    FlightRing::Notes notes;
  };
  std::deque<Order> orders_ GUARDED_BY(mutex_);
  std::optional<Last> last_ GUARDED_BY(mutex_);
  std::thread writer_;
  std::thread thread_;  // last: uses all of the above
};

}  // namespace hapticd::server
