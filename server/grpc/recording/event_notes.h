#pragma once

#include <functional>
#include <string>

#include "server/access/audit_log.h"
#include "server/recording/event_board.h"
#include "server/session/session.h"

namespace hapticd::server {

/// Writes what happens outside the loop to the board, with the present instant and tick. For any thread.
class EventNotes {
 public:
  EventNotes(Session& session, EventBoard& board) : session_(session), board_(board) {}

  void note(recording::EventKind kind, std::string text, const std::string& by = {});
  /// Notes a command of a client that was granted, as the audit log has it.
  void note_call(const AuditLine& line);
  /// note() of one kind.
  std::function<void(const std::string&)> of(recording::EventKind kind) {
    return [this, kind](const std::string& text) { note(kind, text); };
  }

 private:
  Session& session_;
  EventBoard& board_;
};

}  // namespace hapticd::server
