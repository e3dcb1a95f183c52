#include "server/grpc/services/access_service.h"

#include <utility>

#include "server/access/access_table.h"
#include "server/access/console_door.h"
#include "server/access/role_policy.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/access_messages.h"
#include "server/grpc/messages/status.h"

namespace hapticd::server {

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

void AccessService::show_console_at(ConsoleUrls urls) {
  const std::lock_guard lock(mutex_);
  urls_ = std::move(urls);
}

grpc::Status AccessService::OpenConsole(grpc::ServerContext*, const v1::OpenConsoleRequest*,
                                        v1::OpenConsoleResponse* response) {
  const Identity& who = served_call()->who;
  ConsoleUrls urls;
  {
    const std::lock_guard lock(mutex_);
    urls = urls_;
  }
  const bool by_certificate = who.is_remote() || urls.plain.empty();
  if (by_certificate ? urls.tls.empty() : urls.plain.empty()) {
    return to_status(
        {RefusalKind::kFailedPrecondition,
         {who.is_remote() && !urls.plain.empty() ? "the console is shown on the rig's own machine only"
                                                 : "the daemon shows no console",
          "[console]", who.name, "",
          who.is_remote() ? "set listen_tls in [console] of the daemon's configuration"
                          : "set listen = \"127.0.0.1:50080\" in [console] of the daemon's "
                            "configuration, or start it with --console 127.0.0.1:50080"}});
  }
  if (by_certificate) {
    response->set_url(urls.tls + "/");
    return grpc::Status::OK;
  }
  const std::string key = door_.issue_key(who);
  if (key.empty()) {
    return to_status(
        {RefusalKind::kResourceExhausted,
         {"too many addresses of the console wait to be opened", "", "", "256", "wait a minute"}});
  }
  response->set_url(urls.plain + "/open?key=" + key);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
