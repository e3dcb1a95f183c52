#pragma once

#include "hapticd/v1/rendering.grpc.pb.h"
#include "server/grpc/calls/target_log.h"

namespace hapticd::server {

class TargetControl;
class TelemetryHub;

class RenderingService final : public v1::RenderingService::Service {
 public:
  RenderingService(TargetControl& targets, TelemetryHub& hub) : targets_(targets), hub_(hub) {}

  grpc::Status SetTarget(grpc::ServerContext* context, const v1::SetTargetRequest* request,
                         v1::SetTargetResponse* response) override;
  grpc::Status GetFeasibleRange(grpc::ServerContext* context, const v1::GetFeasibleRangeRequest* request,
                                v1::FeasibleRange* response) override;

 private:
  TargetControl& targets_;
  TelemetryHub& hub_;
  TargetLog log_;
};

}  // namespace hapticd::server
