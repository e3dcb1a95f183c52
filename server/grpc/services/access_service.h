#pragma once

#include <mutex>
#include <string>

#include "hapticd/v1/access.grpc.pb.h"

namespace hapticd::server {

class ConsoleDoor;
class RolePolicy;

class AccessService final : public v1::AccessService::Service {
 public:
  /// Where browsers find the console; empty: not shown.
  struct ConsoleUrls {
    std::string plain;  ///< "http://127.0.0.1:50080"
    std::string tls;
  };
  AccessService(const RolePolicy& policy, ConsoleDoor& door) : policy_(policy), door_(door) {}
  void show_console_at(ConsoleUrls urls);

  grpc::Status GetAccess(grpc::ServerContext* context, const v1::GetAccessRequest* request,
                         v1::Access* response) override;
  grpc::Status OpenConsole(grpc::ServerContext* context, const v1::OpenConsoleRequest* request,
                           v1::OpenConsoleResponse* response) override;

 private:
  const RolePolicy& policy_;
  ConsoleDoor& door_;
  std::mutex mutex_;
  ConsoleUrls urls_;
};

}  // namespace hapticd::server
