#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>

namespace hapticd::server {

/// The answer to a request whose bytes are no message of its method: INVALID_ARGUMENT with the method, the
/// limit and the remedy, in place of gRPC's own INTERNAL without a word. A handler of the service never
/// answers INTERNAL without a text, so that these two are the sign. For calls of one request; where the
/// request is taken as bytes (Stop, Subscribe) its service answers itself. nullptr where nothing is to be
/// watched.
std::unique_ptr<grpc::experimental::Interceptor> watch_for_unreadable_request(
    const grpc::experimental::ServerRpcInfo& call);

}  // namespace hapticd::server
