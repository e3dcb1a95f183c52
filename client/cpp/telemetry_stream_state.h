#pragma once

// Internal to the library: the gRPC side of a subscription.

#include <memory>
#include <string>

#include "client/cpp/server_stream.h"
#include "client/cpp/telemetry_stream.h"
#include "hapticd/v1/telemetry.grpc.pb.h"

namespace hapticd::client {

struct TelemetryStream::State {
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::SubscribeRequest& request,
        const std::string& address)
      : account(request.decimation()),
        stub(v1::TelemetryService::NewStub(channel)),
        stream(address, [&](grpc::ClientContext* context, grpc::CompletionQueue* queue) {
          return stub->AsyncSubscribe(context, request, queue, nullptr);
        }) {}

  StreamAccount account;
  std::unique_ptr<v1::TelemetryService::Stub> stub;
  ServerStream<v1::TelemetryBatch> stream;
};

}  // namespace hapticd::client
