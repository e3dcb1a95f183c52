#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>
#include <grpcpp/support/status.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/access/access_table.h"
#include "server/access/identity.h"

namespace hapticd::server {

class AuditLog;
class LeaseManager;
class Session;

/// A call that was let in: by whom, and under which state of control.
struct ServedCall {
  Identity who;
  std::string token;  ///< of a lease, as the client sent it
  const AccessRow* row = nullptr;
  std::uint64_t lease = 0;  ///< number of the state of control; 0 if the call needs no lease
  bool by_holder = false;
  const LeaseManager* leases = nullptr;
  const Session* session = nullptr;
  AuditLog* audit = nullptr;
  std::shared_ptr<const void> place;  ///< of CallQuota; a stream keeps it to its end
  std::string arguments;              ///< as text
  // Where the answer is sent by the thread that serves the call: what it was.
  grpc::Status status;
  std::optional<std::uint64_t> effective_tick;

  /// Writes the line of the audit log, if the call has one.
  void note_end() const;
  void note_end(const grpc::Status& end, std::optional<std::uint64_t> tick);
};

/// The call that this thread serves; nullptr outside of one.
ServedCall* served_call();

/// Ends a call of the callback interface: notes how the one that this thread serves ended, and sends the
/// answer.
grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext& context, const grpc::Status& status);

/// Makes a call the one that this thread serves.
class ServedCallScope {
 public:
  explicit ServedCallScope(ServedCall& call);
  ~ServedCallScope();
  ServedCallScope(const ServedCallScope&) = delete;
  ServedCallScope& operator=(const ServedCallScope&) = delete;

 private:
  ServedCall* before_;
};

}  // namespace hapticd::server
