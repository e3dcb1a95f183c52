#include "server/grpc/services/access_service.h"

#include <string>

#include "server/access/access_table.h"
#include "server/access/console_registry.h"
#include "server/access/role_policy.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/access_messages.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

namespace {
constexpr std::size_t kMaxUrl = 512;
}

grpc::Status AccessService::GetAccess(grpc::ServerContext*, const v1::GetAccessRequest*,
                                      v1::Access* response) {
  const Identity& who = served_call()->who;
  response->set_identity(who.name);
  response->set_role(to_proto(who.role));
  response->set_role_source(who.role_source);
  response->set_lease_rule(to_proto(policy_.lease_rule(who)));
  for (const AccessRow& row : kAccessTable) {
    v1::AccessRule& rule = *response->add_rules();
    rule.set_method(std::string(row.method));
    rule.set_role(to_proto(row.role));
    rule.set_needs_lease(row.needs_lease);
    rule.set_is_audited(row.is_audited);
  }
  return grpc::Status::OK;
}

grpc::Status AccessService::OpenConsole(grpc::ServerContext*, const v1::OpenConsoleRequest*,
                                        v1::OpenConsoleResponse* response) {
  const Identity& who = served_call()->who;
  const ConsoleRegistry::Urls urls = consoles_.urls();
  const bool by_certificate = who.is_remote() || urls.plain.empty();
  if (by_certificate ? urls.tls.empty() : urls.plain.empty()) {
    const bool is_elsewhere = who.is_remote() && !urls.plain.empty();
    return to_status(
        {RefusalKind::kFailedPrecondition,
         {is_elsewhere ? "the console is shown on the rig's own machine only" : "no console runs",
          "hapticd-console", who.name, "a console that reports itself to the daemon",
          is_elsewhere ? "set listen_tls in its configuration, or start your own: hapticctl console"
                       : "start the service hapticd-console, or your own: hapticctl console"}});
  }
  if (by_certificate) {
    response->set_url(urls.tls + "/");
    return grpc::Status::OK;
  }
  const std::string key = consoles_.issue_key(who.name);
  if (key.empty()) {
    return to_status(
        {RefusalKind::kResourceExhausted,
         {"too many addresses of the console wait to be opened", "", "", "256", "wait a minute"}});
  }
  response->set_url(urls.plain + "/open?key=" + key);
  return grpc::Status::OK;
}

grpc::Status AccessService::ReportConsole(grpc::ServerContext*, const v1::ReportConsoleRequest* request,
                                          v1::ReportConsoleResponse*) {
  for (const std::string* url : {&request->url(), &request->tls_url()}) {
    if (url->size() <= kMaxUrl) continue;
    return to_status(
        {RefusalKind::kInvalidArgument,
         {"the address is too long", "ReportConsoleRequest", std::to_string(url->size()) + " bytes",
          std::to_string(kMaxUrl) + " bytes", "give the console a shorter name"}});
  }
  consoles_.report({request->url(), request->tls_url()});
  return grpc::Status::OK;
}

grpc::Status AccessService::RedeemConsoleKey(grpc::ServerContext*, const v1::RedeemConsoleKeyRequest* request,
                                             v1::RedeemConsoleKeyResponse* response) {
  const auto name = consoles_.redeem(request->key());
  if (!name) {
    return to_status(
        {RefusalKind::kNotFound,
         {"this key was used before, or more than a minute ago", "RedeemConsoleKeyRequest.key", "",
          "a key of OpenConsole, once, within a minute", "hapticctl console makes another"}});
  }
  response->set_identity(*name);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
