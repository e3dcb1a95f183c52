#pragma once

// Internal to the library.

#include <grpcpp/grpcpp.h>

#include <memory>

#include "client/cpp/client.h"

namespace hapticd::client {

/// A channel that connects with its first call: plain within this machine, with certificates elsewhere.
/// Throws Error: kBadAddress.
std::shared_ptr<grpc::Channel> make_channel(const ClientOptions& options,
                                            grpc::ChannelArguments arguments = {});
/// Opens a channel and connects it. Throws Error: kBadAddress, kUnreachable.
std::shared_ptr<grpc::Channel> open_channel(const ClientOptions& options);

}  // namespace hapticd::client
