#pragma once

#include <functional>
#include <string>

#include "server/access/audit_log.h"
#include "server/recording/event_log.h"
#include "server/session/session.h"

namespace hapticd::server {

/// Writes what happens outside the loop to the event log, with the present instant and tick. For any thread.
class EventNotes {
 public:
  EventNotes(Session& session, EventLog& event_log) : session_(session), event_log_(event_log) {}

  void note(recording::EventKind kind, std::string text, const std::string& by = {});
  /// Notes a command of a client that was granted, as the audit log has it.
  void note_call(const AuditLine& line);
  /// note() of one kind.
  std::function<void(const std::string&)> of(recording::EventKind kind) {
    return [this, kind](const std::string& text) { note(kind, text); };
  }

 private:
  Session& session_;
  EventLog& event_log_;
};

}  // namespace hapticd::server
