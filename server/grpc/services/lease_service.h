#pragma once

#include <atomic>

#include "hapticd/v1/access.grpc.pb.h"
#include "server/grpc/calls/counted_call.h"

namespace hapticd::server {

class LeaseManager;

/// RenewLease uses the callback interface: it needs no thread of the pool, which other calls may have used
/// up.
class LeaseService final : public v1::LeaseService::WithCallbackMethod_RenewLease<v1::LeaseService::Service> {
 public:
  /// Streams at once; more are refused, since each holds one of the server's threads. The same for takes that
  /// wait.
  static constexpr int kMaxWatchers = 16;
  static constexpr int kMaxTakers = 4;

  explicit LeaseService(LeaseManager& leases) : leases_(leases) {}

  grpc::Status AcquireLease(grpc::ServerContext* context, const v1::AcquireLeaseRequest* request,
                            v1::LeaseGrant* response) override;
  grpc::Status TakeLease(grpc::ServerContext* context, const v1::TakeLeaseRequest* request,
                         v1::LeaseGrant* response) override;
  grpc::ServerUnaryReactor* RenewLease(grpc::CallbackServerContext* context,
                                       const v1::RenewLeaseRequest* request, v1::Lease* response) override;
  grpc::Status ReturnLease(grpc::ServerContext* context, const v1::ReturnLeaseRequest* request,
                           v1::ReturnLeaseResponse* response) override;
  grpc::Status GetLease(grpc::ServerContext* context, const v1::GetLeaseRequest* request,
                        v1::LeaseState* response) override;
  grpc::Status WatchLease(grpc::ServerContext* context, const v1::WatchLeaseRequest* request,
                          grpc::ServerWriter<v1::LeaseState>* writer) override;

 private:
  LeaseManager& leases_;
  SharedPlaces watchers_{kMaxWatchers};
  std::atomic<int> takers_{0};
};

}  // namespace hapticd::server
