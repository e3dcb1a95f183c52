#include "server/grpc/gate/access_gate.h"

#include <fmt/format.h>
#include <grpcpp/server_context.h>

#include <string>

#include "server/access/audit_log.h"
#include "server/access/call_quota.h"
#include "server/access/certificate.h"
#include "server/access/connected_users.h"
#include "server/access/console_door.h"
#include "server/access/console_metadata.h"
#include "server/access/lease_desk.h"

namespace hapticd::server {

namespace {

constexpr const char* kTokenKey = "hapticd-lease";

std::string first_property(const grpc::AuthContext& auth, const char* name) {
  const auto values = auth.FindPropertyValues(name);
  return values.empty() ? std::string() : std::string(values.front().data(), values.front().size());
}

std::string metadata_of(const grpc::ServerContextBase& context, const char* key) {
  const auto& metadata = context.client_metadata();
  const auto found = metadata.find(key);
  return found == metadata.end() ? std::string() : std::string(found->second.data(), found->second.size());
}

/// What any identity may do is to stop, or to ask who it is; and without the others the force would go.
bool is_never_limited(const AccessRow& row) {
  return row.role == Role::kNone || row.method == "WatchdogService/CheckIn" ||
         row.method == "LeaseService/RenewLease";
}

Refusal denied(const Identity& who) {
  return {RefusalKind::kUnauthenticated,
          {"this identity is on the deny list", "[access.denied]", who.name, who.denied_why,
           "ask a maintainer of the rig"}};
}

Refusal wrong_role(const Identity& who, const AccessRow& row) {
  return {RefusalKind::kPermissionDenied,
          {fmt::format("this call needs the role of {} {}", row.role == Role::kObserver ? "an" : "a",
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
  Identity who;
  if (const std::string pass = metadata_of(context, kConsolePassKey);
      !pass.empty() && parts_.door != nullptr) {
    if (auto holder = parts_.door->holder_of(pass)) {
      holder->peer = "console " + metadata_of(context, kConsolePeerKey);
      return *holder;
    }
  }
  const auto auth = context.auth_context();
  if (auth && auth->IsPeerAuthenticated()) {
    std::string uri = first_property(*auth, "peer_spiffe_id");
    if (uri.empty()) uri = first_property(*auth, "peer_uri");
    std::string serial;
    if (parts_.policy.denies_serials()) {
      serial = serial_of_certificate(first_property(*auth, "x509_pem_cert"));
    }
    who = parts_.policy.of_certificate(uri, serial);
  } else if (peer.starts_with("unix:")) {
    who = parts_.policy.of_unix_socket(parts_.unix_group);
  } else {
    who = parts_.policy.of_user(parts_.users.find(peer));
  }
  who.peer = peer;
  return who;
}

std::optional<Refusal> AccessGate::admit(const AccessRow* row, const grpc::ServerContextBase& context,
                                         ServedCall& call) const {
  call.who = identify(context);
  call.token = metadata_of(context, kTokenKey);
  call.row = row;
  call.desk = &parts_.desk;
  call.session = &parts_.session;
  call.audit = &parts_.audit;
  if (row == nullptr) {
    return Refusal{RefusalKind::kPermissionDenied,
                   {"this call is in no table of access", "", "", "", "report it"}};
  }
  if (call.who.is_denied) return denied(call.who);
  if (call.who.role < row->role) return wrong_role(call.who, *row);
  if (!is_never_limited(*row)) {
    auto place = parts_.quota.take(call.who.name, CallQuota::Clock::now());
    if (!place) return place.refusal();
    call.place = std::move(*place);
  }
  if (!row->needs_lease) {
    if (!call.token.empty()) parts_.desk.note_use(call.who, call.token);
    return std::nullopt;
  }
  const auto admitted = parts_.desk.admit(call.who, call.token, parts_.policy.lease_rule(call.who));
  if (!admitted) return admitted.refusal();
  call.lease = admitted->number;
  call.by_holder = admitted->by_holder;
  return std::nullopt;
}

}  // namespace hapticd::server
