#pragma once

#include "hal/part_report.h"
#include "rt/record/tick_record.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

class SceneHost;
class Session;
class TelemetryHub;
class TurntableHost;

/// What a report of a part of the rig means.
Findings examine_part(const hal::PartReport& report);

/// Whether the guard lets force through, as the newest record has it; nothing where it does.
Findings examine_guard(const rt::TickRecord& newest);

/// What to look at.
struct Diagnosed {
  Session& session;
  const SceneHost& scenes;
  TelemetryHub& hub;
  TurntableHost& turntable;
};

/// Machine, loop, guard, the force under the loaded scene, and the parts of the rig. Watches the loop for
/// half a second; with `probe` it opens hardware that no one needs now, and closes it again.
Findings diagnose(const Diagnosed& rig, bool probe);

}  // namespace hapticd::server
