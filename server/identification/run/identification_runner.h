#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/error.h"
#include "server/identification/run/identification_task.h"
#include "server/identification/run/recording_shelf.h"
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

/// How an identification stands.
struct IdentificationReport {
  std::string id;
  std::string kind;
  std::string object;
  std::string recording;
  IdentificationState state = IdentificationState::kRunning;
  double time_limit_s = 0.0;
  identification::IdentificationProgress progress;
  std::string instruction;
  std::string model;  ///< hash of what was stored
  std::optional<hal::Error> problem;
  std::uint64_t version = 0;  ///< rises with every change
};

/// Runs identifications, one at a time, in a thread of its own: listens to the loop, has the simulated hand
/// do what is wanted or instructs the user, and stores what was found. It belongs to the daemon: clients come
/// and go. Any thread may call.
class IdentificationRunner {
 public:
  static constexpr std::size_t kKept = 64;

  IdentificationRunner(Session& session, SceneHost& scenes, TelemetryHub& hub, const SensorBiases& biases,
                       ModelStore& store);
  /// Cancels what runs.
  ~IdentificationRunner();
  IdentificationRunner(const IdentificationRunner&) = delete;
  IdentificationRunner& operator=(const IdentificationRunner&) = delete;

  /// Returns once it runs. `lease`: number of the state of control it was started under.
  Outcome<std::string> start(const IdentificationRequest& request, std::uint64_t lease = 0);
  /// Cancels what runs on the rig if it was started under this number; the report says why. Waits for
  /// nothing.
  void end_under(std::uint64_t lease, const hal::Error& why);
  /// The report of an identification; empty id = of the one that runs, else the last. With `newer_than`, as
  /// soon as its version is beyond that, it is over, or the caller's timeout is.
  Outcome<IdentificationReport> report(const std::string& id, std::uint64_t newer_than, const Caller& caller);
  /// Ends it and waits until it has.
  Outcome<IdentificationReport> cancel(const std::string& id, const Caller& caller);
  /// Newest first.
  std::vector<IdentificationReport> list() const;
  /// Cancels what runs and starts nothing any more.
  void shutdown();

  RecordingShelf& recordings() { return shelf_; }
  /// Called when one is over, in its thread, in words. Set before the first.
  void on_end(std::function<void(const std::string& words)> call) { on_end_ = std::move(call); }

 private:
  /// Why data stopped coming.
  enum class Ending : std::uint8_t { kConverged, kNoMoreData, kCancelled, kFault };
  struct Run;
  struct Ended {
    Ending ending = Ending::kNoMoreData;
    std::optional<hal::Error> problem;
  };

  void perform(Run& run);
  Ended listen_to_rig(Run& run);
  Ended listen_to_recording(Run& run);
  void conclude(Run& run, const Ended& ended);
  /// What the rig is to do next; an error where the rig does not.
  std::optional<Refusal> arrange(Run& run, const identification::MotionRequest& request);
  /// The guard is latched, and that matters: someone stopped everything, or force is needed.
  bool is_held_back(const IdentificationTask& task);
  void publish(const Run& run, const identification::IdentificationProgress& progress);
  IdentificationReport* find_locked(const std::string& id);

  Session& session_;
  SceneHost& scenes_;
  TelemetryHub& hub_;
  const SensorBiases& biases_;
  ModelStore& store_;
  RecordingShelf shelf_;
  std::function<void(const std::string&)> on_end_ = [](const std::string&) {};

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<IdentificationReport> reports_;  ///< newest first
  std::uint64_t started_ = 0;
  std::uint64_t lease_ = 0;  ///< of what runs on the rig; 0 = none
  std::optional<hal::Error> lost_control_;
  bool shut_down_ = false;
  std::atomic<bool> cancel_{false};
  std::thread thread_;
};

}  // namespace hapticd::server
