#pragma once

#include "server/caller.h"

namespace grpc {
class ServerContextBase;
}

namespace hapticd::server {

/// Deadline and presence of the client behind a call. Valid as long as the call.
Caller caller_of(const grpc::ServerContextBase& context);

}  // namespace hapticd::server
