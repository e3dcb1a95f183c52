#pragma once

#include "hal/part_report.h"
#include "server/diagnosis/finding.h"

namespace hapticd::server {

class Session;
class TurntableHost;

/// What a report of a part of the rig means.
Findings examine_part(const hal::PartReport& report);

/// Machine, loop and the parts of the rig. Watches the loop for half a second; with `probe` it opens hardware
/// that nobody needs now, and closes it again.
Findings diagnose(Session& session, TurntableHost& turntable, bool probe);

}  // namespace hapticd::server
