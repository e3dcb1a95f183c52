#pragma once

#include <string>

namespace hapticd::client {

/// Where a daemon listens when no one says otherwise.
inline constexpr const char* kDefaultAddress = "127.0.0.1:50051";

/// Turns "host:port", "[v6]:port", each also with "tls:" before it, or "unix:/path" into the name gRPC knows
/// it by. Throws Error (kBadAddress) for anything else.
std::string channel_target(const std::string& address);

}  // namespace hapticd::client
