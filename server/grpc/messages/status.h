#pragma once

#include <grpcpp/support/status.h>

#include "hapticd/v1/common.pb.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// Makes a gRPC status of a refusal, for all services: code, one line of text, and as details a
/// google.rpc.Status with a hapticd.v1.ErrorDetail.
grpc::Status to_status(const Refusal& refusal);
/// Detail with the error's five parts.
v1::ErrorDetail to_detail(const hal::Error& error);

}  // namespace hapticd::server
