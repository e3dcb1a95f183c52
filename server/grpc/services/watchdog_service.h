#pragma once

#include "hapticd/v1/watchdog.grpc.pb.h"

namespace hapticd::server {

class Watchdog;

/// CheckIn uses the callback interface: it needs no thread of the pool, which waiting calls may have used up.
class WatchdogService final
    : public v1::WatchdogService::WithCallbackMethod_CheckIn<v1::WatchdogService::Service> {
 public:
  explicit WatchdogService(Watchdog& watchdog) : watchdog_(watchdog) {}

  grpc::ServerUnaryReactor* CheckIn(grpc::CallbackServerContext* context, const v1::CheckInRequest* request,
                                    v1::CheckInResponse* response) override;
  grpc::Status GetWatchdog(grpc::ServerContext* context, const v1::GetWatchdogRequest* request,
                           v1::Watchdog* response) override;

 private:
  Watchdog& watchdog_;
};

}  // namespace hapticd::server
