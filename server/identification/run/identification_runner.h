#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "server/identification/run/identification_task.h"
#include "server/identification/run/recording_store.h"
#include "server/identification/session/identification.h"
#include "server/scene/scene_host.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/session.h"

namespace hapticd::server {

class ModelStore;
class SensorBiases;
class TelemetryHub;

struct IdentificationRequest {
  IdentificationTask task;
  std::string object;
  identification::PressGeometry geometry;  ///< on the rig
  std::string recording;                   ///< id of an uploaded one; empty = on the rig
  std::string reference_recording;  ///< inclusion: of the object without it, id of an uploaded one; or empty
  std::string reference_model;      ///< inclusion: of the object without it, NAME or NAME@TAG; or empty
  double time_limit_s = 60.0;       ///< of the rig's time
  bool adopt = false;               ///< tag the model "current" when it has converged
};

enum class IdentificationState : std::uint8_t { kRunning, kConverged, kPartial, kCancelled, kFailed };

/// State of an identification.
struct IdentificationReport {
  std::string id;
  std::string kind;
  std::string object;
  std::string recording;
  IdentificationState state = IdentificationState::kRunning;
  bool is_of_earlier_run = false;  ///< of the daemon: time limit, progress and instruction are not known
  double time_limit_s = 0.0;
  identification::IdentificationProgress progress;
  std::string instruction;
  std::string model;  ///< hash of what was stored
  std::optional<hal::Error> problem;
  std::uint64_t version = 0;  ///< rises with every change
};

/// Runs identifications, one at a time, on its own thread: listens to the loop, has the simulated hand do
/// what is wanted or instructs the user, and stores what was found. It belongs to the daemon: clients come
/// and go. Any thread may call. Its budget is two threads and one row of each recording in memory: the thread
/// that runs, and that of the call that starts the next one, which reads the recording once before.
/// Recordings are read, files made and the model store waited for without its lock.
class IdentificationRunner {
 public:
  static constexpr std::size_t kKept = 64;

  IdentificationRunner(Session& session, SceneHost& scenes, TelemetryHub& hub, const SensorBiases& biases,
                       ModelStore& store);
  /// Cancels what runs.
  ~IdentificationRunner();
  IdentificationRunner(const IdentificationRunner&) = delete;
  IdentificationRunner& operator=(const IdentificationRunner&) = delete;

  /// Returns once it runs. `lease`: number of the state of control it was started under. Of calls at the same
  /// time all but the first are refused as busy.
  Outcome<std::string> start(const IdentificationRequest& request, std::uint64_t lease = 0) EXCLUDES(mutex_);
  /// Cancels what runs on the rig if it was started under this number; the report says why. Does not wait.
  void end_under(std::uint64_t lease, const hal::Error& why) EXCLUDES(mutex_);
  /// Report of an identification; empty id = of the one that runs, else the last. With `newer_than`, returns
  /// as soon as its version is beyond that, it is over, or the caller's timeout is.
  Outcome<IdentificationReport> report(const std::string& id, std::uint64_t newer_than, const Caller& caller);
  /// Ends it and waits until it has.
  Outcome<IdentificationReport> cancel(const std::string& id, const Caller& caller);
  /// Lists the reports, newest first.
  std::vector<IdentificationReport> list() const;
  /// Cancels what runs and starts nothing more.
  void shutdown();

  RecordingStore& recordings() { return recordings_; }
  /// Sets what is called when one is over, on its thread, in words. Set it before the first.
  void on_end(Callback<void(const std::string& words)> call) { on_end_ = std::move(call); }

 private:
  /// Reason why data stopped coming.
  enum class Ending : std::uint8_t { kConverged, kNoMoreData, kCancelled, kFault };
  struct Run;
  /// Right to begin the next one, from the check that none is under way to the moment at which it runs.
  class Turn;
  struct Ended {
    Ending ending = Ending::kNoMoreData;
    std::optional<hal::Error> problem;
  };

  Outcome<std::unique_ptr<Turn>> take_turn(const IdentificationRequest& request, std::uint64_t lease)
      EXCLUDES(mutex_);
  std::optional<Refusal> prepare_recorded(Run& run) EXCLUDES(mutex_);
  std::optional<Refusal> prepare_live(Run& run) EXCLUDES(mutex_);
  Outcome<std::string> begin(std::unique_ptr<Run> run, Turn& turn) EXCLUDES(mutex_);
  void perform(Run& run);
  Ended listen_to_rig(Run& run);
  Ended listen_to_recording(Run& run);
  void conclude(Run& run, const Ended& ended);
  /// Arranges what the rig is to do next; an error if the rig does not.
  std::optional<Refusal> arrange(Run& run, const identification::MotionRequest& request);
  /// True if the guard is latched, and that matters: someone stopped everything, or force is needed.
  bool is_held_back(const IdentificationTask& task);
  void publish(const Run& run, const identification::IdentificationProgress& progress);
  IdentificationReport* find_locked(const std::string& id) REQUIRES(mutex_);

  Session& session_;
  SceneHost& scenes_;
  TelemetryHub& hub_;
  const SensorBiases& biases_;
  ModelStore& store_;
  RecordingStore recordings_;
  Callback<void(const std::string&)> on_end_ = [](const std::string&) {};

  mutable Mutex mutex_;
  Condition changed_;
  std::deque<IdentificationReport> reports_ GUARDED_BY(mutex_);  ///< newest first
  std::uint64_t started_ GUARDED_BY(mutex_) = 0;
  bool starting_ GUARDED_BY(mutex_) = false;    ///< a call has the turn to begin the next one
  std::uint64_t lease_ GUARDED_BY(mutex_) = 0;  ///< of what runs, or begins, on the rig; 0 = none
  std::optional<hal::Error> lost_control_ GUARDED_BY(mutex_);
  bool shut_down_ GUARDED_BY(mutex_) = false;
  std::atomic<bool> cancel_{false};
  std::thread thread_;  ///< of the call that has the turn; after shutdown() of none
};

}  // namespace hapticd::server
