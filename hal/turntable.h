#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "hal/part_report.h"
#include "hal/samples.h"

namespace hapticd::hal {

/// An object's place on the table: the angle that brings it under the tool.
struct TurntableStation {
  std::string name;
  double angle_deg = 0.0;
  std::string object;               ///< on a simulated rig, what is there; empty = nothing is known of it
  Vector3 tool_mm{0.0, 0.0, 30.0};  ///< where the tip waits above the object, rig frame
};

/// How fast a motion may be; 0 = as fast as the turntable's own limits allow.
struct MotionLimits {
  double speed_deg_per_s = 0.0;
  double acceleration_deg_per_s2 = 0.0;
};

/// What a turntable is, fixed from its start to its end.
struct TurntableInfo {
  std::string name;  ///< e.g. "modbus:oriental_az"
  double min_deg = 0.0;
  double max_deg = 0.0;
  MotionLimits limits;         ///< of every motion
  double tolerance_deg = 0.0;  ///< how near its target a motion has to end
  double stale_after_s = 0.0;  ///< a position older than this counts as unknown
  std::vector<TurntableStation> stations;
};

enum class TurntableState : std::uint8_t {
  kIdle,        ///< not engaged: no port is open
  kConnecting,  ///< engaged, but the drive has not reported its position yet
  kNotHomed,    ///< the drive does not know where it is
  kHoming,
  kStanding,
  kMoving,
  kStalled,  ///< it did not move although it was asked to; until someone clears it
  kAlarm,    ///< the drive reports an alarm; until someone clears it
  kLost,     ///< its position is not known any more: no connection, or no usable answers
};

enum class MotionKind : std::uint8_t { kNone, kHome, kMove };

/// How a motion ended.
enum class MotionEnd : std::uint8_t {
  kNone,  ///< there was no motion yet
  kUnderWay,
  kArrived,    ///< and the drive's own position says so
  kStopped,    ///< someone stopped it
  kForbidden,  ///< the permit was refused or withdrawn
  kTimedOut,
  kStalled,
  kMissed,  ///< the drive says that it has arrived, but is elsewhere
  kAlarm,
  kLost,     ///< contact with the drive was lost on the way: where it is is not known
  kRefused,  ///< the drive did not take the order
};

/// The motion under way, or the last one.
struct MotionReport {
  std::uint64_t number = 0;  ///< counts motions from 1
  MotionKind kind = MotionKind::kNone;
  MotionEnd end = MotionEnd::kNone;
  bool stopping = false;  ///< under way, but asked to stop
  std::optional<double> target_deg;
  double completion = 0.0;  ///< of the way, 0 … 1; homing has no known length and stays 0
  double elapsed_s = 0.0;
  double expected_s = 0.0;       ///< by the trapezoid; 0 for homing
  std::optional<Error> problem;  ///< why it did not arrive
};

struct TurntableStatus {
  TurntableState state = TurntableState::kIdle;
  std::optional<double> position_deg;  ///< the last one reported since it was engaged
  double position_age_s = std::numeric_limits<double>::infinity();
  double velocity_deg_per_s = 0.0;
  bool homed = false;
  std::string station;  ///< where it is; empty between stations, in motion, not homed or not fresh
  std::uint32_t alarm_code = 0;
  std::string alarm_text;
  MotionReport motion;
};

/// Nothing, or why the table must not turn now. Asked on the turntable's thread before any motion and every
/// few milliseconds on the way: it neither blocks nor calls the turntable.
using MotionPermit = Callback<std::optional<Error>()>;

/// A table that brings one object or another under the tool. Every function may be called from any thread;
/// only engage() and disengage() take their time.
class Turntable {
 public:
  virtual ~Turntable() = default;
  virtual const TurntableInfo& info() const noexcept = 0;

  /// Opens the port and returns once the drive has reported its position, or says why it does not. Engaged
  /// already: nothing happens.
  virtual std::optional<Error> engage() = 0;
  /// Stops the table if it moves, then lets go of the port.
  virtual void disengage() noexcept = 0;

  virtual TurntableStatus status() const = 0;
  virtual PartReport report() const = 0;

  /// Sets the permit in place of the one before; an empty one forbids nothing.
  virtual void set_permit(MotionPermit permit) = 0;
  /// Begins a motion and returns its number; how it ends is reported by status(). Refused while another one
  /// is under way, without a fresh position, in an alarm or stall, or without the permit. move_to() needs a
  /// homed table.
  virtual Result<std::uint64_t> home() = 0;
  virtual Result<std::uint64_t> move_to(double angle_deg, const MotionLimits& limits) = 0;
  /// Stops as fast as the drive can, whichever client began the motion. Does nothing at rest.
  virtual void stop() = 0;
  /// Leaves a stall, and has the drive leave its alarm; whether it does is reported by status().
  virtual std::optional<Error> clear_alarm() = 0;
};

/// Words as the contract and the terminal know them, e.g. "not_homed".
const char* word_of(TurntableState state) noexcept;
const char* word_of(MotionEnd end) noexcept;

}  // namespace hapticd::hal
