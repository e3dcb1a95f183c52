#pragma once

#include "hapticd/v1/access.grpc.pb.h"

namespace hapticd::server {

class ConsoleRegistry;
class RolePolicy;

class AccessService final : public v1::AccessService::Service {
 public:
  AccessService(const RolePolicy& policy, ConsoleRegistry& consoles) : policy_(policy), consoles_(consoles) {}

  grpc::Status GetAccess(grpc::ServerContext* context, const v1::GetAccessRequest* request,
                         v1::Access* response) override;
  grpc::Status OpenConsole(grpc::ServerContext* context, const v1::OpenConsoleRequest* request,
                           v1::OpenConsoleResponse* response) override;
  grpc::Status ReportConsole(grpc::ServerContext* context, const v1::ReportConsoleRequest* request,
                             v1::ReportConsoleResponse* response) override;
  grpc::Status RedeemConsoleKey(grpc::ServerContext* context, const v1::RedeemConsoleKeyRequest* request,
                                v1::RedeemConsoleKeyResponse* response) override;

 private:
  const RolePolicy& policy_;
  ConsoleRegistry& consoles_;
};

}  // namespace hapticd::server
