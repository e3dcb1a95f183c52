#include "server/grpc/calls/call.h"

#include <grpcpp/server_context.h>

#include <string>

#include "server/access/lease_manager.h"
#include "server/grpc/calls/served_call.h"
#include "server/process/log.h"

namespace hapticd::server {

Caller caller_of(const grpc::ServerContextBase& context) {
  Caller caller;
  // The client's deadline is reported on the system clock; a caller waits on the steady one. No wait is
  // longer than a day, and adding that never overflows.
  constexpr std::chrono::hours kEver{24};
  const auto remaining = context.deadline() - std::chrono::system_clock::now();
  if (remaining < kEver) caller.deadline = Caller::Clock::now() + remaining;
  caller.cancelled = [&context] { return context.IsCancelled(); };
  if (const ServedCall* call = served_call()) {
    caller.lease = call->lease;
    if (call->by_holder) {
      caller.lost = [leases = call->leases, number = call->lease] { return leases->lost(number); };
    }
  }
  return caller;
}

void log_call(std::string_view what, const grpc::ServerContextBase& context) {
  const ServedCall* call = served_call();
  log_info(std::string(what) + " by " +
           (call == nullptr ? context.peer() : call->who.name + " at " + call->who.peer));
}

}  // namespace hapticd::server
