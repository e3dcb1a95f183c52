#pragma once

#include <functional>
#include <optional>
#include <string>

#include "hal/samples.h"
#include "rt/assist/tool_guide.h"
#include "rt/record/tick_record.h"
#include "server/session/caller.h"
#include "server/session/outcome.h"

namespace hapticd::server {

class SceneHost;
class Session;
class TelemetryHub;
class TurntableHost;

/// Destination of the tool; exactly one of the first three.
struct ToolDestination {
  std::optional<hal::Vector3> point_mm;
  std::string above_station;
  std::optional<double> until_contact_mm;

  std::optional<double> max_speed_mm_per_s;
  std::optional<double> max_force_n;
  std::optional<double> timeout_s;
};

/// Motions on which the device leads the tool: one at a time, and none while anything else has the scene. Any
/// thread.
class GuideHost {
 public:
  struct Status {
    rt::TickRecord record;  ///< of the tick in which it was so
    hal::Vector3 goal_mm;
  };
  /// Called during the motion, in the thread of the call; false ends it.
  using Progress = std::function<bool(const Status&)>;

  GuideHost(Session& session, SceneHost& scenes, TelemetryHub& hub, TurntableHost& turntable)
      : session_(session), scenes_(scenes), hub_(hub), turntable_(turntable) {}

  /// Returns once the device has let go. Refused if it ended neither at its goal nor in contact.
  Outcome<Status> move(const ToolDestination& destination, const Caller& caller, const Progress& progress);

 private:
  Outcome<rt::GuideMotion> motion_to(const ToolDestination& destination, const rt::TickRecord& now);
  Outcome<hal::Vector3> goal_of(const ToolDestination& destination, const rt::TickRecord& now);
  Outcome<Status> follow(std::uint32_t number, const hal::Vector3& goal_mm, const Caller& caller,
                         const Progress& progress);

  Session& session_;
  SceneHost& scenes_;
  TelemetryHub& hub_;
  TurntableHost& turntable_;
};

}  // namespace hapticd::server
