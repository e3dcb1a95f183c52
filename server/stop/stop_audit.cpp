#include "server/stop/stop_audit.h"

#include <string>
#include <utility>

#include "server/access/audit_log.h"
#include "server/access/local_user.h"
#include "server/access/role_policy.h"
#include "server/process/log.h"

namespace hapticd::server {

namespace {

Identity identity_of(const StopReport& report, const StopLogs& logs) {
  if (report.path == StopPath::kTls) return logs.policy.of_certificate(report.name.data(), "");
  const LocalUser user = report.has_user ? user_of_id(report.user) : LocalUser{};
  return report.path == StopPath::kDatagram ? logs.policy.of_unix_user(user, logs.unix_group)
                                            : logs.policy.of_user(user);
}

}  // namespace

void note_stop(const StopReport& report, std::uint64_t unreported, const StopLogs& logs) {
  const Identity who = identity_of(report, logs);
  AuditLine line;
  line.identity = who.name.empty() ? "a certificate without a name" : who.name;
  line.role = to_text(who.role);
  line.unix_ns = report.unix_ns;
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
  logs.audit.write(std::move(line));
}

}  // namespace hapticd::server
