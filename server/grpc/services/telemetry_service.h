#pragma once

#include "hapticd/v1/telemetry.grpc.pb.h"

namespace hapticd::server {

class TelemetryHub;

/// One stream per subscriber, by the callback interface: a waiting stream holds no thread. Raw, so that
/// samples for several subscribers are encoded once.
class TelemetryService final
    : public v1::TelemetryService::WithRawCallbackMethod_Subscribe<v1::TelemetryService::Service> {
 public:
  explicit TelemetryService(TelemetryHub& hub) : hub_(hub) {}

  grpc::ServerWriteReactor<grpc::ByteBuffer>* Subscribe(grpc::CallbackServerContext* context,
                                                        const grpc::ByteBuffer* request) override;

 private:
  TelemetryHub& hub_;
};

}  // namespace hapticd::server
