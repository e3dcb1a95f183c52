#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "hal/lock/mutex.h"
#include "hal/samples.h"
#include "server/scene/scene_models.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"

namespace hapticd::server {

class SceneHost;
class Session;
class TelemetryHub;

/// A zero of the force sensor that this daemon took.
struct SensorBias {
  std::string id;            ///< "2026-11-22T21:03:20Z/2": start of the daemon, serial number of the zero
  std::uint32_t serial = 0;  ///< hal::RigSample::bias_serial of the samples under it
  std::int64_t taken_unix_s = 0;  ///< when
  hal::Vector3 tip_mm;            ///< where the tool was, rig frame
  hal::Quaternion orientation;    ///< how it was held: its weight is part of the zero
};

/// The present zero of the force sensor's samples, for as long as the daemon runs. A zero holds over scenes,
/// identifications and motions of the table. It ends with the next bias, or when the driver loses it (the box
/// restarted, or its calibration changed). Any thread.
class SensorBiases {
 public:
  /// What a tool's turning and a sensor's drift move a zero by. A zero that is wrong by no more renders
  /// nothing in free air.
  static constexpr double kMaxZeroChangeN = 0.4;

  /// Makes it; each new zero is appended to `file` as a line; empty = none.
  SensorBiases(Session& session, const SceneHost& scenes, TelemetryHub& hub, std::string file);

  /// Takes the present load as zero. Out of contact, the tool at rest (StillnessMonitor), and not while an
  /// identification or a motion of the table is under way. Nothing is biased for a caller that has lost its
  /// lease, was cancelled or has no time left. Returns when samples with the new zero arrive. A zero that was
  /// disturbed is reported as an error and is not current(). `tool_is_free`: someone says so, although the
  /// sensor reads more than kMaxZeroChangeN under the last bias.
  Outcome<SensorBias> take(const Caller& caller, bool tool_is_free);
  /// Present bias; nothing if none was taken since the start, or the driver lost it.
  std::optional<SensorBias> current() const;
  /// The id of the last one, if the driver lost it.
  std::optional<std::string> lost() const;
  /// Zero in the form that scenes and identifications need.
  ZeroInForce zero_in_force() const;

 private:
  std::string identity_of(std::uint32_t serial) const;
  std::optional<Refusal> pressed() const;
  void keep(const SensorBias& bias) const;

  Session& session_;
  const SceneHost& scenes_;
  TelemetryHub& hub_;
  const std::string file_;
  const std::string started_;
  mutable Mutex mutex_;
  std::optional<SensorBias> last_ GUARDED_BY(mutex_);
};

}  // namespace hapticd::server
