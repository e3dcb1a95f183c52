#include "server/grpc/services/lease_service.h"

#include <chrono>
#include <cmath>

#include "server/access/lease_manager.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/counted_call.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/access_messages.h"
#include "server/grpc/messages/status.h"
#include "server/text/range.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr Range kTtlS{1.0, 60.0, "s"};
constexpr std::size_t kMaxPurpose = 200;
/// How often a watcher that hears nothing is asked whether it is still there.
constexpr std::chrono::milliseconds kLeaseWatchSlice{100};

template <class Request>
Outcome<LeaseTerms> terms_of(const Request& request, const char* where) {
  LeaseTerms terms;
  terms.purpose = shortened(repaired_utf8(request.purpose()), kMaxPurpose);
  terms.on_expiry = expiry_of(request.on_expiry());
  if (!request.has_ttl_s()) return terms;
  if (const auto error = check(request.ttl_s(), kTtlS, "the time to live", where)) {
    return Refusal{std::isfinite(request.ttl_s()) ? RefusalKind::kOutOfRange : RefusalKind::kInvalidArgument,
                   *error};
  }
  terms.ttl =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(request.ttl_s()));
  return terms;
}

void fill(const LeaseGranted& granted, v1::LeaseGrant& message) {
  server::fill(granted.lease, *message.mutable_lease());
  message.set_token(granted.token);
  message.set_changed_after_tick(granted.changed_after_tick);
}

}  // namespace

grpc::Status LeaseService::AcquireLease(grpc::ServerContext* context, const v1::AcquireLeaseRequest* request,
                                        v1::LeaseGrant* response) {
  const auto terms = terms_of(*request, "AcquireLeaseRequest.ttl_s");
  if (!terms) return to_status(terms.refusal());
  const auto granted = leases_.acquire(served_call()->who, *terms);
  if (!granted) return to_status(granted.refusal());
  log_call("the lease was acquired", *context);
  fill(*granted, *response);
  return grpc::Status::OK;
}

grpc::Status LeaseService::TakeLease(grpc::ServerContext* context, const v1::TakeLeaseRequest* request,
                                     v1::LeaseGrant* response) {
  const auto terms = terms_of(*request, "TakeLeaseRequest.ttl_s");
  if (!terms) return to_status(terms.refusal());
  if (request->reason().empty()) {
    return to_status(
        {RefusalKind::kInvalidArgument,
         {"no reason is given", "TakeLeaseRequest.reason", "", "", "say why: the present holder reads it"}});
  }
  const CountedCall counted(takers_, kMaxTakers);
  if (!counted.admitted()) return counted.refusal("takes", "TakeLease");
  const auto granted =
      leases_.take(served_call()->who, *terms, shortened(repaired_utf8(request->reason()), kMaxPurpose),
                   caller_of(*context));
  if (!granted) return to_status(granted.refusal());
  log_call("the lease was taken", *context);
  fill(*granted, *response);
  return grpc::Status::OK;
}

grpc::ServerUnaryReactor* LeaseService::RenewLease(grpc::CallbackServerContext* context,
                                                   const v1::RenewLeaseRequest*, v1::Lease* response) {
  const ServedCall& call = *served_call();
  const auto lease = leases_.renew(call.who, call.token);
  if (lease) fill(*lease, *response);
  return finish(*context, lease ? grpc::Status::OK : to_status(lease.refusal()));
}

grpc::Status LeaseService::ReturnLease(grpc::ServerContext*, const v1::ReturnLeaseRequest*,
                                       v1::ReturnLeaseResponse*) {
  leases_.give_back(served_call()->who, served_call()->token);
  return grpc::Status::OK;
}

grpc::Status LeaseService::GetLease(grpc::ServerContext*, const v1::GetLeaseRequest*,
                                    v1::LeaseState* response) {
  fill(leases_.snapshot(), *response);
  return grpc::Status::OK;
}

grpc::Status LeaseService::WatchLease(grpc::ServerContext* context, const v1::WatchLeaseRequest*,
                                      grpc::ServerWriter<v1::LeaseState>* writer) {
  const PlacedCall counted(watchers_);
  if (!counted.admitted()) return counted.refusal("watchers", "WatchLease");
  const Caller caller = caller_of(*context);
  for (std::uint64_t seen = 0; !caller.cancelled() && !leases_.ended();) {
    const LeaseSnapshot state = leases_.await_change(seen, LeaseManager::Clock::now() + kLeaseWatchSlice);
    if (state.version == seen) continue;
    seen = state.version;
    v1::LeaseState message;
    fill(state, message);
    if (!writer->Write(message)) break;
  }
  return leases_.ended()
             ? to_status({RefusalKind::kUnavailable,
                          {"the service is shutting down", "lease", "", "", "connect again later"}})
             : grpc::Status::CANCELLED;
}

}  // namespace hapticd::server
