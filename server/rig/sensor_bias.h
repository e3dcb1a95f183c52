#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

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
  hal::Quaternion orientation;    ///< and how it was held: its weight then reads as nothing
};

/// Which zero the force sensor's samples are under, for as long as the daemon runs. A zero outlasts scenes,
/// identifications and motions of the table; it ends with the next bias, and where the driver lost it (a box
/// restarted, or has another calibration). Any thread.
class SensorBiases {
 public:
  /// Those that are taken are appended to `file`, one line each; empty = nowhere.
  SensorBiases(Session& session, const SceneHost& scenes, TelemetryHub& hub, std::string file);

  /// Takes the present load as zero. Out of contact, and not while an identification or a motion of the table
  /// is under way. Returns once samples come under the new zero.
  Outcome<SensorBias> take(const Caller& caller);
  /// The one in force; nothing where none was taken since the start, or the driver lost it.
  std::optional<SensorBias> current() const;
  /// Where the last one that was taken is not in force any more: its id.
  std::optional<std::string> lost() const;
  /// As scenes and identifications ask for it.
  ZeroInForce zero_in_force() const;

 private:
  std::string identity_of(std::uint32_t serial) const;
  void keep(const SensorBias& bias) const;

  Session& session_;
  const SceneHost& scenes_;
  TelemetryHub& hub_;
  const std::string file_;
  const std::string started_;
  mutable std::mutex mutex_;
  std::optional<SensorBias> last_;
};

}  // namespace hapticd::server
