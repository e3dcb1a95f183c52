#pragma once

#include "hal/part_report.h"
#include "rt/record/tick_record.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

class SceneHost;
class Session;
class TelemetryHub;
class TurntableHost;

/// Examines a report on a part of the rig.
Findings examine_part(const hal::PartReport& report);

/// Examines why the guard withholds force, by the newest record; nothing if it does not. A fault of the device
/// that has passed is named by its report.
Findings examine_guard(const rt::TickRecord& newest, const std::vector<hal::PartReport>& reports);

/// What to examine.
struct Diagnosed {
  Session& session;
  const SceneHost& scenes;
  TelemetryHub& hub;
  TurntableHost& turntable;
};

/// Examines machine, loop, guard, the force under the loaded scene, and the parts of the rig. Watches the
/// loop for half a second; with `probe` it opens hardware that is not in use, and closes it again.
Findings diagnose(const Diagnosed& rig, bool probe);

}  // namespace hapticd::server
