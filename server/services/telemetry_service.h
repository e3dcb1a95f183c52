#pragma once

#include "hapticd/v1/telemetry.grpc.pb.h"

namespace hapticd::server {

class TelemetryHub;

/// One stream per subscriber, by the callback interface: a waiting stream holds no thread.
class TelemetryService final : public v1::TelemetryService::CallbackService {
 public:
  explicit TelemetryService(TelemetryHub& hub) : hub_(hub) {}

  grpc::ServerWriteReactor<v1::TelemetryBatch>* Subscribe(grpc::CallbackServerContext* context,
                                                          const v1::SubscribeRequest* request) override;

 private:
  TelemetryHub& hub_;
};

}  // namespace hapticd::server
