#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "hapticd/v1/access.grpc.pb.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {

/// A client that can hold the lease.
class AccessClient : public ServiceClient {
 public:
  explicit AccessClient(std::shared_ptr<grpc::Channel> connection)
      : ServiceClient(std::move(connection)),
        access(v1::AccessService::NewStub(channel)),
        lease(v1::LeaseService::NewStub(channel)) {}

  /// Context with the token of the lease, if there is one.
  std::unique_ptr<grpc::ClientContext> context() const {
    auto made = call_context();
    if (!token.empty()) made->AddMetadata("hapticd-lease", token);
    return made;
  }
  grpc::Status acquire(const v1::AcquireLeaseRequest& request = {}) {
    v1::LeaseGrant grant;
    const grpc::Status status = lease->AcquireLease(call_context().get(), request, &grant);
    if (status.ok()) token = grant.token();
    return status;
  }
  grpc::Status take(v1::LeaseGrant* granted = nullptr) {
    v1::TakeLeaseRequest request;
    request.set_reason("it is my turn");
    v1::LeaseGrant grant;
    const grpc::Status status = lease->TakeLease(call_context().get(), request, &grant);
    if (status.ok()) token = grant.token();
    if (granted != nullptr) *granted = grant;
    return status;
  }
  grpc::Status give_back() {
    v1::ReturnLeaseResponse response;
    const grpc::Status status = lease->ReturnLease(context().get(), {}, &response);
    token.clear();
    return status;
  }
  v1::LeaseState lease_state() const {
    v1::LeaseState state;
    EXPECT_TRUE(lease->GetLease(call_context().get(), {}, &state).ok());
    return state;
  }
  grpc::Status set(double stiffness_n_per_mm, v1::SetTargetResponse* response = nullptr) const {
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(stiffness_n_per_mm);
    v1::SetTargetResponse unused;
    return rendering->SetTarget(context().get(), request, response != nullptr ? response : &unused);
  }

  std::unique_ptr<v1::AccessService::Stub> access;
  std::unique_ptr<v1::LeaseService::Stub> lease;
  std::string token;
};

}  // namespace hapticd::test
