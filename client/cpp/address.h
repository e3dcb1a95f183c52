#pragma once

#include <string>

namespace hapticd::client {

/// Address of the daemon when none is given.
inline constexpr const char* kDefaultAddress = "127.0.0.1:50051";

/// Turns "host:port", "[v6]:port", each also with "tls:" before it, or "unix:/path" into the name gRPC knows
/// it by. Throws Error (kBadAddress) for anything else.
std::string channel_target(const std::string& address);

}  // namespace hapticd::client
