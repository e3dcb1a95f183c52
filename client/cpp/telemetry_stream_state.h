#pragma once

// Internal to the library: the gRPC side of a subscription.

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "client/cpp/telemetry_stream.h"
#include "hapticd/v1/telemetry.grpc.pb.h"

namespace hapticd::client {

struct TelemetryStream::State {
  State(const std::shared_ptr<grpc::Channel>& channel, const v1::SubscribeRequest& request,
        std::string server_address);
  ~State();
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  /// Waits for the one operation under way. False when `wait` passed first.
  bool await(std::chrono::milliseconds wait, bool& succeeded);

  std::string address;
  StreamAccount account;
  std::unique_ptr<v1::TelemetryService::Stub> stub;
  grpc::ClientContext context;
  grpc::CompletionQueue queue;
  v1::TelemetryBatch incoming;
  grpc::Status status;
  enum class Phase { kStarting, kReading, kFinishing, kDone } phase = Phase::kStarting;
  bool cancelled = false;
  std::unique_ptr<grpc::ClientAsyncReader<v1::TelemetryBatch>> reader;
};

}  // namespace hapticd::client
