#pragma once

// Internal to the library: the lease under which a client's calls go.

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "hal/lock/mutex.h"
#include "hapticd/v1/access.grpc.pb.h"

namespace hapticd::client {

/// The token of a lease, and the thread that renews it three times in its time to live.
class LeaseKeeper {
 public:
  /// `token`: of a lease that another program keeps; empty: none. Throws Error for a malformed one.
  LeaseKeeper(std::shared_ptr<grpc::Channel> channel, std::string token);
  /// Gives back what it keeps.
  ~LeaseKeeper();
  LeaseKeeper(const LeaseKeeper&) = delete;
  LeaseKeeper& operator=(const LeaseKeeper&) = delete;

  std::string token() const;
  /// Keeps a lease from now on. Throws Error (kUnreadable) if it is not a grant.
  void keep(const v1::LeaseGrant& grant);
  /// No error if it is over already.
  void give_back();
  /// Whether the lease that keep() took is still this client's, as far as it can know: false once the daemon
  /// said that it is over, or could not be asked for its time to live.
  bool holds() const;
  /// Adds the token to a call.
  void add_to(grpc::ClientContext& context) const;

 private:
  void run();

  const std::unique_ptr<v1::LeaseService::Stub> stub_;
  mutable Mutex mutex_;
  Condition changed_;
  std::string token_ GUARDED_BY(mutex_);
  std::chrono::nanoseconds ttl_ GUARDED_BY(mutex_){0};  ///< of a lease that is kept here; 0 = none
  std::chrono::steady_clock::time_point renewed_at_ GUARDED_BY(mutex_);
  bool ending_ GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace hapticd::client
