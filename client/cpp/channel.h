#pragma once

// Internal to the library.

#include <grpcpp/grpcpp.h>

#include <memory>

#include "client/cpp/client.h"

namespace hapticd::client {

/// Connects: plain within this machine, with certificates elsewhere. Throws Error: kBadAddress, kUnreachable.
std::shared_ptr<grpc::Channel> open_channel(const ClientOptions& options);

}  // namespace hapticd::client
