#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "server/access/identity.h"
#include "server/access/role_policy.h"
#include "server/grpc/calls/served_call.h"
#include "server/session/outcome.h"

namespace grpc {
class ServerContextBase;
}

namespace hapticd::server {

class AuditLog;
class CallQuota;
class ConnectedUsers;
class ConsoleDoor;
class LeaseDesk;
class Session;

/// Decides about every call before its request is read: who asks, has it the role, does it control the rig.
class AccessGate {
 public:
  struct Parts {
    const RolePolicy& policy;
    const ConnectedUsers& users;
    LeaseDesk& desk;
    AuditLog& audit;
    CallQuota& quota;
    const Session& session;
    std::string unix_group;             ///< of the unix socket
    const ConsoleDoor* door = nullptr;  ///< to browsers
  };
  explicit AccessGate(Parts parts) : parts_(std::move(parts)) {}

  /// Fills `call`; nothing where it may go on. `row`: nullptr for a method that is in no table.
  std::optional<Refusal> admit(const AccessRow* row, const grpc::ServerContextBase& context,
                               ServedCall& call) const;

 private:
  Identity identify(const grpc::ServerContextBase& context) const;

  const Parts parts_;
};

}  // namespace hapticd::server
