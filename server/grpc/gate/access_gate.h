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
class ConnectionTable;
class LeaseManager;
class NamedIdentities;
class Session;

/// Decides about every call before its request is read: who asks, and for whom; has it the role; does it
/// control the rig.
class AccessGate {
 public:
  struct Parts {
    const RolePolicy& policy;
    const ConnectionTable& connections;
    LeaseManager& leases;
    AuditLog& audit;
    CallQuota& quota;
    const Session& session;
    NamedIdentities& named;  ///< those that a console calls on behalf of
  };
  explicit AccessGate(Parts parts) : parts_(std::move(parts)) {}

  /// Fills `call`; nothing if it may go on. `row`: nullptr for a method that is in no table.
  std::optional<Refusal> admit(const AccessRow* row, const grpc::ServerContextBase& context,
                               ServedCall& call) const;

 private:
  /// Identifies the client at the other end of the connection.
  Identity identify(const grpc::ServerContextBase& context) const;
  /// Makes `who` the identity on whose behalf the call is made, if there is one. Refused from all but a
  /// console.
  std::optional<Refusal> take_name(const AccessRow* row, const grpc::ServerContextBase& context,
                                   Identity& who) const;

  const Parts parts_;
};

}  // namespace hapticd::server
