#pragma once

#include "hapticd/v1/safety.grpc.pb.h"
#include "server/grpc/calls/waiting_desk.h"

namespace hapticd::server {

class SafetyLatch;

/// Stop and Clear use the callback interface: they need no thread of the pool, which waiting calls may have
/// used up. Stop is raw, so that it takes effect before its request is read.
class SafetyService final : public v1::SafetyService::WithRawCallbackMethod_Stop<
                                v1::SafetyService::WithCallbackMethod_Clear<v1::SafetyService::Service>> {
 public:
  explicit SafetyService(SafetyLatch& latch) : latch_(latch) {}

  grpc::ServerUnaryReactor* Stop(grpc::CallbackServerContext* context, const grpc::ByteBuffer* request,
                                 grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* Clear(grpc::CallbackServerContext* context, const v1::ClearRequest* request,
                                  v1::ClearResponse* response) override;
  grpc::Status ListFaults(grpc::ServerContext* context, const v1::ListFaultsRequest* request,
                          v1::ListFaultsResponse* response) override;

 private:
  SafetyLatch& latch_;
  WaitingDesk clears_{"hapticd-clear"};
};

}  // namespace hapticd::server
