#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

namespace hapticd::server {

/// Answers a request whose bytes are not a message of its method with INVALID_ARGUMENT, the method, the limit
/// and the remedy, instead of gRPC's own INTERNAL or UNIMPLEMENTED without a text. A handler of the
/// service never answers either without a text, so the two together identify the case. For calls with one
/// request; a service that takes its request as bytes (Stop, Subscribe) answers itself. Keeps for the audit
/// log how the call of this thread ended. nullptr for calls that are not watched.
std::unique_ptr<grpc::experimental::Interceptor> watch_for_unreadable_request(
    const grpc::experimental::ServerRpcInfo& call);

}  // namespace hapticd::server
