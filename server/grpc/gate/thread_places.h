#pragma once

#include <grpc/grpc.h>
#include <grpcpp/support/server_interceptor.h>
#include <grpcpp/support/status.h>

#include <memory>

#include "server/grpc/calls/counted_call.h"

namespace hapticd::server {

class ConnectionTable;

/// Threads of the server that calls hold until their answers have gone: a client that does not read keeps
/// them. No identity gets so many that the others find none. Calls of the callback interface hold none.
struct ThreadPlaces {
  static constexpr int kMaxCalls = 128;
  static constexpr int kMaxReflections = 8;
  /// The rest looks for new calls, and ends those that find no place.
  static constexpr int kMaxThreads = kMaxCalls + kMaxReflections + 24;

  SharedPlaces calls{kMaxCalls, 48};
  /// Streams of gRPC's reflection, which passes no gate.
  SharedPlaces reflections{kMaxReflections, 4};
};

/// Ends a call whose client may not read, with RESOURCE_EXHAUSTED: waits for nothing. `where`: the method.
grpc::Status end_without_place(grpc_call* call, const PlacedCall& place, const char* where);

/// Holds a place for a stream of reflection, and ends one that finds none. nullptr for all other calls.
/// `connections`: to find the identity of its client.
std::unique_ptr<grpc::experimental::Interceptor> place_of_reflection(grpc::experimental::ServerRpcInfo& call,
                                                                     const ConnectionTable& connections,
                                                                     SharedPlaces& places);

}  // namespace hapticd::server
