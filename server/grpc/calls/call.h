#pragma once

#include <string_view>

#include "server/session/caller.h"

namespace grpc {
class ServerContextBase;
}

namespace hapticd::server {

/// Deadline and presence of the client behind a call. Valid as long as the call.
Caller caller_of(const grpc::ServerContextBase& context);

/// Writes into the log what which client did: "scene 'wall' loaded by ipv4:127.0.0.1:40712".
void log_call(std::string_view what, const grpc::ServerContextBase& context);

}  // namespace hapticd::server
