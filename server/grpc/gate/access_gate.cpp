#include "server/grpc/gate/access_gate.h"

#include <fmt/format.h>
#include <grpcpp/server_context.h>

#include <string>

#include "server/access/audit_log.h"
#include "server/access/call_quota.h"
#include "server/access/lease_manager.h"
#include "server/access/named_identities.h"
#include "server/connection/connection_table.h"

namespace hapticd::server {

namespace {

constexpr const char* kTokenKey = "hapticd-lease";

std::string metadata_of(const grpc::ServerContextBase& context, const char* key) {
  const auto& metadata = context.client_metadata();
  const auto found = metadata.find(key);
  return found == metadata.end() ? std::string() : std::string(found->second.data(), found->second.size());
}

/// True for what any identity may do: to stop, or to ask who it is. A console's own calls are few, and their
/// identity is that of the whole group of the unix socket. Without the others the force would go.
bool is_never_limited(const AccessRow& row) {
  return row.role == Role::kNone || row.role == Role::kConsole || row.method == "WatchdogService/CheckIn" ||
         row.method == "LeaseService/RenewLease";
}

Refusal denied(const Identity& who) {
  return {RefusalKind::kUnauthenticated,
          {"this identity is on the deny list: " + who.denied_why, "[access.denied]", who.name, "",
           "ask a maintainer of the rig"}};
}

/// Holder for a call: the person who sees to the cause of a stop clears it, also next to a program of theirs
/// that holds the lease.
LeaseManager::Holder holder_for(const AccessRow& row) {
  return row.method == "SafetyService/Clear" ? LeaseManager::Holder::kIdentity
                                             : LeaseManager::Holder::kProgram;
}

bool may(const Identity& who, const AccessRow& row) {
  return row.role == Role::kConsole ? who.is_console : who.role >= row.role;
}

Refusal no_console(const Identity& who, const std::string& named) {
  return {
      RefusalKind::kPermissionDenied,
      {"this client cannot call on behalf of others", kOnBehalfKey, fmt::format("{} for {}", who.name, named),
       "a console: the unix socket and the user of [console] user, or a certificate of the role console",
       "call without this metadata, as yourself"}};
}

Refusal wrong_role(const Identity& who, const AccessRow& row) {
  return {RefusalKind::kPermissionDenied,
          {fmt::format("this call needs the role of {} {}",
                       row.role == Role::kObserver || row.role == Role::kOperator ? "an" : "a",
                       to_text(row.role)),
           std::string(row.method),
           fmt::format("{} is {} (by {})", who.name.empty() ? "a certificate without a name" : who.name,
                       who.role == Role::kNone ? "without a role" : std::string(to_text(who.role)),
                       who.role_source),
           "hapticctl access lists what every call needs",
           "ask a maintainer of the rig for a line in [access], or for another certificate"}};
}

}  // namespace

Identity AccessGate::identify(const grpc::ServerContextBase& context) const {
  const std::string peer = context.peer();
  if (auto who = parts_.connections.find(peer)) return *who;
  Identity unknown = parts_.policy.of_user({});
  unknown.peer = peer;
  // A call that began long after its connection was closed: a certificate's must not become this machine's.
  if (ConnectionTable::is_relayed(peer)) {
    unknown.is_denied = true;
    unknown.denied_why = "its connection was closed before the call began";
  }
  return unknown;
}

std::optional<Refusal> AccessGate::take_name(const AccessRow* row, const grpc::ServerContextBase& context,
                                             Identity& who) const {
  const std::string named = metadata_of(context, kOnBehalfKey);
  if (named.empty()) return std::nullopt;
  if (!who.is_console) {
    // A stop stops, whatever comes with it.
    const bool is_for_all = row != nullptr && row->role == Role::kNone;
    return is_for_all ? std::nullopt : std::optional(no_console(who, named));
  }
  Identity person = parts_.named.find(named, metadata_of(context, kOnBehalfSerialKey));
  person.peer = "console " + metadata_of(context, kBrowserKey);
  if (who.is_denied) {
    person.is_denied = true;
    person.denied_why = who.denied_why;
  }
  who = std::move(person);
  return std::nullopt;
}

std::optional<Refusal> AccessGate::admit(const AccessRow* row, const grpc::ServerContextBase& context,
                                         ServedCall& call) const {
  call.who = identify(context);
  call.token = metadata_of(context, kTokenKey);
  call.row = row;
  call.leases = &parts_.leases;
  call.session = &parts_.session;
  call.audit = &parts_.audit;
  if (auto refusal = take_name(row, context, call.who)) return refusal;
  if (row == nullptr) {
    return Refusal{RefusalKind::kPermissionDenied,
                   {"this call is in no table of access", "", "", "", "report it"}};
  }
  if (call.who.is_denied) return denied(call.who);
  if (!may(call.who, *row)) return wrong_role(call.who, *row);
  if (!is_never_limited(*row)) {
    auto place = parts_.quota.take(call.who.name, CallQuota::Clock::now());
    if (!place) return place.refusal();
    call.place = std::move(*place);
  }
  if (!row->needs_lease) {
    // What any identity may do asks for no lease: it must not wait for one who changes it.
    if (row->role != Role::kNone && !call.token.empty()) parts_.leases.note_use(call.who, call.token);
    return std::nullopt;
  }
  const auto admitted =
      parts_.leases.admit(call.who, call.token, parts_.policy.lease_rule(call.who), holder_for(*row));
  if (!admitted) return admitted.refusal();
  call.lease = admitted->number;
  call.by_holder = admitted->by_holder;
  return std::nullopt;
}

}  // namespace hapticd::server
