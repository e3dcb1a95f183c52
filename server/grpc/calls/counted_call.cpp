#include "server/grpc/calls/counted_call.h"

#include <fmt/format.h>

#include "server/grpc/messages/status.h"

namespace hapticd::server {

grpc::Status CountedCall::refusal(const char* what, const char* where) const {
  return to_status({RefusalKind::kResourceExhausted,
                    {fmt::format("too many {} at once", what), where, "", fmt::format("up to {}", max_),
                     "wait for one to end"}});
}

}  // namespace hapticd::server
