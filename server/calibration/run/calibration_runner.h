#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/lock/mutex.h"
#include "server/calibration/estimate/coverage.h"
#include "server/calibration/estimate/streams.h"
#include "server/calibration/store/calibration_store.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

struct CalibrationRequest {
  calibration::CalibrationKind kind = calibration::CalibrationKind::kKinematics;
  double time_limit_s = 120.0;
  bool own_clock = false;
  bool recorded = false;
  bool simulated_tracker = false;
  std::string tip_calibration;
  bool adopt = false;
};

enum class CalibrationState : std::uint8_t { kRecording, kFitting, kStored, kCancelled, kFailed };

struct CalibrationReport {
  std::string id;
  calibration::CalibrationKind kind = calibration::CalibrationKind::kKinematics;
  CalibrationState state = CalibrationState::kRecording;
  double duration_s = 0.0;
  double time_limit_s = 0.0;
  std::size_t reference_poses = 0;
  std::size_t rig_poses = 0;
  double completion = 0.0;
  std::string instruction;
  std::vector<calibration::CoverageItem> coverage;
  std::string stored;
  std::optional<hal::Error> problem;
  std::uint64_t version = 0;

  bool over() const { return state != CalibrationState::kRecording && state != CalibrationState::kFitting; }
};

/// Runs calibrations, one at a time, on its own thread: takes the rig's poses from the telemetry hub and the
/// tracker's from the client that pushes them, reports what the motion lacks, fits and stores. The loop knows
/// nothing of it. Any thread may call.
class CalibrationRunner {
 public:
  static constexpr std::size_t kMaxPoses = 200'000;     ///< of the tracker
  static constexpr std::size_t kMaxRigPoses = 500'000;  ///< the longest calibration has 450 000

  CalibrationRunner(Session& session, TelemetryHub& hub, CalibrationStore& store)
      : session_(session), hub_(hub), store_(store) {}
  ~CalibrationRunner();
  CalibrationRunner(const CalibrationRunner&) = delete;
  CalibrationRunner& operator=(const CalibrationRunner&) = delete;

  /// Returns once it runs. `lease`: number of the state of control it was started under.
  Outcome<std::string> start(const CalibrationRequest& request, std::uint64_t lease = 0);
  /// Cancels what runs if it was started under this number; the report says why. What is not adopted by then
  /// is not adopted. Does not wait.
  void end_under(std::uint64_t lease, const hal::Error& why);
  /// Poses of the tracker, and of the rig if it is recorded. Refused if a number is none, there are too many,
  /// or nothing runs that takes them.
  std::optional<Refusal> push(const std::vector<calibration::ReferencePose>& reference,
                              const std::vector<calibration::RigPose>& rig);
  /// Fits what there is, and waits until that is over.
  Outcome<CalibrationReport> finish(const Caller& caller);
  /// Ends it, also while it is fitted, and waits until that is over.
  Outcome<CalibrationReport> cancel(const Caller& caller);
  Outcome<CalibrationReport> report(const std::string& id, std::uint64_t newer_than, const Caller& caller);
  CalibrationStore& store() { return store_; }

 private:
  std::optional<Refusal> check_request(const CalibrationRequest& request) const;
  std::optional<Refusal> move_simulated_hand(const CalibrationRequest& request);
  /// Begins what is prepared; returns its id.
  Outcome<std::string> begin(const CalibrationRequest& request);
  void perform(const CalibrationRequest& request);
  void listen(const CalibrationRequest& request);
  void take_rig_poses(Subscription& subscription);
  void take_simulated_poses();
  void look_at_motion(calibration::CalibrationKind kind);
  /// Returns the state it ends in.
  Outcome<CalibrationState> conclude(const CalibrationRequest& request);
  Outcome<StoredCalibration> fit(const CalibrationRequest& request, const calibration::RigStream& rig,
                                 std::vector<calibration::ReferencePose> reference);
  Outcome<CalibrationReport> wait_until_over(const Caller& caller);

  Session& session_;
  TelemetryHub& hub_;
  CalibrationStore& store_;

  mutable Mutex mutex_;
  Condition changed_;
  bool takes_rig_poses_ GUARDED_BY(mutex_) = false;  ///< of a recording, from the client
  CalibrationReport report_ GUARDED_BY(mutex_);      ///< of the one that runs, or the last one
  calibration::RigStream rig_ GUARDED_BY(mutex_);
  std::vector<calibration::ReferencePose> reference_ GUARDED_BY(mutex_);
  /// Smallest difference so far: the tracker's clock begins there.
  double first_arrival_less_stamp_s_ GUARDED_BY(mutex_) = 0.0;
  std::uint64_t started_ GUARDED_BY(mutex_) = 0;
  bool running_ GUARDED_BY(mutex_) = false;     ///< or about to begin
  std::uint64_t lease_ GUARDED_BY(mutex_) = 0;  ///< of what runs, or begins
  std::optional<hal::Error> lost_control_ GUARDED_BY(mutex_);
  std::atomic<bool> finish_{false};
  std::atomic<bool> cancel_{false};
  std::thread thread_;  ///< of the call that set running_
};

}  // namespace hapticd::server
