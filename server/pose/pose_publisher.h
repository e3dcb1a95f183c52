#pragma once

#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "hal/lock/callback.h"
#include "hal/lock/mutex.h"
#include "hal/rig.h"
#include "rt/loop/rig_reading.h"
#include "server/calibration/model/adopted_calibration.h"
#include "server/pose/issued_pose.h"
#include "server/pose/pose_maker.h"
#include "server/session/outcome.h"

namespace hapticd::server {
class TelemetryHub;
class Subscription;
}  // namespace hapticd::server

namespace hapticd::pose {

/// Takes what the publisher hands out. Called by the publisher's thread; must not block.
class PoseReceiver {
 public:
  virtual ~PoseReceiver() = default;
  virtual void offer(IssuedPose& issued) = 0;
  /// Ends: no more poses come.
  virtual void end(const server::Refusal& why) = 0;
};

/// Hands out poses to subscribers, each at its own rate. One thread, which sleeps until the next pose is due
/// and reads the telemetry hub then: a pose is hardly older than its tick. Subscribers of one rate are due at
/// the same instants, and those that want the same pose share it. Without subscribers nothing runs. The loop
/// knows nothing of it.
class PosePublisher {
 public:
  struct Parts {
    server::TelemetryHub& hub;
    const hal::RigInfo& rig;
    DeviceFrame frame;
    const calibration::AdoptedCalibration& calibration;
    /// Facts of the scene of this generation; asked when it changes.
    Callback<SceneFacts(std::uint32_t generation)> scene;
    /// Last reading of the rig; nothing if the rig has its own time.
    Callback<std::optional<rt::RigReading>()> reading;
  };
  explicit PosePublisher(Parts parts);
  ~PosePublisher();
  PosePublisher(const PosePublisher&) = delete;
  PosePublisher& operator=(const PosePublisher&) = delete;

  /// `rate_hz` 1 … 1000. Refused: the reference frame without a calibration that has one. The receiver is
  /// held weakly: when it is gone, so is its subscription.
  std::optional<server::Refusal> subscribe(const PoseRequest& request, double rate_hz,
                                           const std::shared_ptr<PoseReceiver>& receiver);
  std::size_t subscribers() const;
  /// Ends all streams; later ones are refused.
  void stop();

 private:
  struct Place {
    PoseRequest request;
    std::int64_t period_ns = 0;
    std::int64_t due_ns = 0;  ///< grid of the rig's clock, or the daemon's if the rig has its own time
    std::uint64_t last_tick = 0;
    bool got_one = false;
    std::weak_ptr<PoseReceiver> receiver;
  };
  struct Work;

  std::optional<server::Refusal> refusal(const PoseRequest& request) const;
  void run();
  void open(Work& work);
  void take_records(Work& work);
  void hand_out(const Work& work, const std::vector<Place>& due);
  void look_at_utc(Work& work, std::int64_t now_ns);

  Parts parts_;
  mutable Mutex mutex_;  ///< not held while a pose is made or handed out
  Condition changed_;
  std::vector<Place> places_ GUARDED_BY(mutex_);
  bool stopping_ GUARDED_BY(mutex_) = false;
  std::thread thread_;  ///< begun by subscribe(), once; joined by stop()
};

}  // namespace hapticd::pose
