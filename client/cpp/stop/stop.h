#pragma once

#include <string>

#include "client/cpp/client.h"
#include "client/cpp/stop_outcome.h"

namespace hapticd::client {

/// Zero force, by both paths at once, without a connection that exists. Returns soon after the first answer.
/// Throws Error if neither answers within ClientOptions::timeout: use the emergency stop.
StopOutcome stop(const ClientOptions& options, const std::string& reason);

}  // namespace hapticd::client
