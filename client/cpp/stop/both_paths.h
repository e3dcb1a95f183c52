#pragma once

// Internal to the library.

#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

#include "client/cpp/client.h"
#include "client/cpp/stop_outcome.h"

namespace hapticd::client {

/// stop() with a channel that exists.
StopOutcome stop_by_both(const ClientOptions& options, const std::shared_ptr<grpc::Channel>& channel,
                         const std::string& reason);

}  // namespace hapticd::client
