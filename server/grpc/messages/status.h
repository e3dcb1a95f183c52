#pragma once

#include <grpcpp/support/status.h>

#include "hapticd/v1/common.pb.h"
#include "server/session/outcome.h"

namespace hapticd::server {

/// The one place where a refusal becomes a gRPC status: code and one line of text, and as structured details
/// a google.rpc.Status that holds a hapticd.v1.ErrorDetail.
grpc::Status to_status(const Refusal& refusal);
/// The error's five parts.
v1::ErrorDetail to_detail(const hal::Error& error);

}  // namespace hapticd::server
