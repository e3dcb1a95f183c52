#pragma once

#include "hapticd/v1/safety.grpc.pb.h"

namespace hapticd::server {

class SafetyLatch;

/// Stop is served by the callback interface: it never waits, so it needs no thread of the pool that calls
/// which do wait may have used up.
class SafetyService final : public v1::SafetyService::WithCallbackMethod_Stop<v1::SafetyService::Service> {
 public:
  explicit SafetyService(SafetyLatch& latch) : latch_(latch) {}

  grpc::ServerUnaryReactor* Stop(grpc::CallbackServerContext* context, const v1::StopRequest* request,
                                 v1::StopResponse* response) override;
  grpc::Status Clear(grpc::ServerContext* context, const v1::ClearRequest* request,
                     v1::ClearResponse* response) override;
  grpc::Status ListFaults(grpc::ServerContext* context, const v1::ListFaultsRequest* request,
                          v1::ListFaultsResponse* response) override;

 private:
  SafetyLatch& latch_;
};

}  // namespace hapticd::server
