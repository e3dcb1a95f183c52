#pragma once

#include <cstdint>

#include "server/stop/stop_report.h"

namespace hapticd::server {

class AuditLog;

/// Writes a stop that did not pass gRPC to the log and to the audit log, where it is a line of
/// SafetyService/Stop like all others. May wait: it looks up the name of the user. `unreported`: how many
/// more there were since the last one.
void note_stop(const StopReport& report, std::uint64_t unreported, AuditLog& audit);

}  // namespace hapticd::server
