// Subscribes at ADDRESS and prints a line per batch, until it is killed.
#include <grpcpp/grpcpp.h>

#include <cstdio>

#include "hapticd/v1/telemetry.grpc.pb.h"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const auto stub = hapticd::v1::TelemetryService::NewStub(
      grpc::CreateChannel(argv[1], grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const auto reader = stub->Subscribe(&context, {});
  hapticd::v1::TelemetryBatch batch;
  while (reader->Read(&batch)) {
    std::printf("%d samples\n", batch.samples_size());
    std::fflush(stdout);
  }
  return 1;
}
