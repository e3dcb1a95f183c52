#include "server/grpc/services/access_service.h"

#include "server/access/access_table.h"
#include "server/access/role_policy.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/access_messages.h"

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

}  // namespace hapticd::server
