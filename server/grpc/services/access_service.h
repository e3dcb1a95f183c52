#pragma once

#include "hapticd/v1/access.grpc.pb.h"

namespace hapticd::server {

class RolePolicy;

class AccessService final : public v1::AccessService::Service {
 public:
  explicit AccessService(const RolePolicy& policy) : policy_(policy) {}

  grpc::Status GetAccess(grpc::ServerContext* context, const v1::GetAccessRequest* request,
                         v1::Access* response) override;

 private:
  const RolePolicy& policy_;
};

}  // namespace hapticd::server
