#pragma once

#include <cstdint>
#include <string>

#include "server/stop/stop_report.h"

namespace hapticd::server {

class AuditLog;
class RolePolicy;

/// Logs of the stops that do not pass gRPC, and the rules by which their senders have names.
struct StopLogs {
  const RolePolicy& policy;
  std::string unix_group;  ///< may open the unix socket
  AuditLog& audit;
};

/// Writes a stop that did not pass gRPC to the log and to the audit log, where it is a line of
/// SafetyService/Stop like all others. May wait: it looks up the name of the user. `unreported`: how many
/// more there were since the last one.
void note_stop(const StopReport& report, std::uint64_t unreported, const StopLogs& logs);

}  // namespace hapticd::server
