#include "server/stop/stop_audit.h"

#include <string>
#include <utility>

#include "server/access/audit_log.h"
#include "server/access/local_user.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

std::string identity_of(const StopReport& report) {
  if (report.path == StopPath::kTls) {
    return report.name[0] == 0 ? "a certificate without a name" : report.name.data();
  }
  return report.has_user ? "user:" + user_of_id(report.user).name : "local";
}

}  // namespace

void note_stop(const StopReport& report, std::uint64_t unreported, AuditLog& audit) {
  AuditLine line;
  line.identity = identity_of(report);
  line.peer = report.peer.data();
  line.tick = report.last_tick;
  line.method = "SafetyService/Stop";
  line.arguments = "by " + std::string(to_text(report.path));
  line.outcome = report.was_refused ? "UNAUTHENTICATED" : "OK";
  if (report.was_refused) line.problem = "it is denied, or what it sent is no stop";
  if (!report.was_refused) line.effective_tick = report.last_tick;
  std::string text = report.was_refused ? "a stop was refused to " : "stopped by ";
  text += line.identity;
  if (report.process != 0) text += " (process " + std::to_string(report.process) + ")";
  text += ", " + line.arguments;
  if (unreported > 0) text += " (and " + std::to_string(unreported) + " more before)";
  log_warning(text);
  audit.write(std::move(line));
}

}  // namespace hapticd::server
