#pragma once

// Internal to the library: the gRPC side of watching an identification.

#include <memory>
#include <string>

#include "client/cpp/identification_stream.h"
#include "client/cpp/server_stream.h"
#include "hapticd/v1/identification.grpc.pb.h"

namespace hapticd::client {

struct IdentificationStream::State {
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::WatchIdentificationRequest& request,
        const std::string& address)
      : stub(v1::IdentificationService::NewStub(channel)),
        stream(address, [&](grpc::ClientContext* context, grpc::CompletionQueue* queue) {
          return stub->AsyncWatchIdentification(context, request, queue, nullptr);
        }) {}

  std::unique_ptr<v1::IdentificationService::Stub> stub;
  ServerStream<v1::IdentificationProgress> stream;
};

}  // namespace hapticd::client
