#pragma once

// Internal to the library.

#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <string>

#include "client/cpp/client.h"
#include "client/cpp/stop_outcome.h"

namespace hapticd::client {

/// Gives the channel of the service. Called in the thread of the call, when the stop port was asked.
using ChannelSource = std::function<std::shared_ptr<grpc::Channel>()>;

/// stop() with a channel that may exist.
StopOutcome stop_by_both(const ClientOptions& options, const ChannelSource& channel,
                         const std::string& reason);

}  // namespace hapticd::client
