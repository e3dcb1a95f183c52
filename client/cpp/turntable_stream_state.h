#pragma once

// Internal to the library: the gRPC side of a motion of the turntable.

#include <memory>
#include <string>

#include "client/cpp/server_stream.h"
#include "client/cpp/turntable_stream.h"
#include "hapticd/v1/turntable.grpc.pb.h"

namespace hapticd::client {

struct TurntableStream::State {
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::HomeRequest& request,
        const std::string& address)
      : stub(v1::TurntableService::NewStub(channel)),
        stream(address, [&](grpc::ClientContext* context, grpc::CompletionQueue* queue) {
          return stub->AsyncHome(context, request, queue, nullptr);
        }) {}
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::MoveToRequest& request,
        const std::string& address)
      : stub(v1::TurntableService::NewStub(channel)),
        stream(address, [&](grpc::ClientContext* context, grpc::CompletionQueue* queue) {
          return stub->AsyncMoveTo(context, request, queue, nullptr);
        }) {}

  std::unique_ptr<v1::TurntableService::Stub> stub;
  ServerStream<v1::TurntableStatus> stream;
};

}  // namespace hapticd::client
