#include "client/cpp/lease_keeper.h"

#include <utility>

namespace hapticd::client {
namespace {

constexpr const char* kTokenKey = "hapticd-lease";
constexpr std::chrono::seconds kReturnTimeout{1};

void set_timeout(grpc::ClientContext& context, std::chrono::nanoseconds timeout) {
  context.set_deadline(std::chrono::system_clock::now() +
                       std::chrono::duration_cast<std::chrono::milliseconds>(timeout));
}

}  // namespace

LeaseKeeper::LeaseKeeper(std::shared_ptr<grpc::Channel> channel, std::string token)
    : stub_(v1::LeaseService::NewStub(std::move(channel))), token_(std::move(token)) {}

LeaseKeeper::~LeaseKeeper() {
  give_back();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::string LeaseKeeper::token() const {
  const std::lock_guard lock(mutex_);
  return token_;
}

void LeaseKeeper::add_to(grpc::ClientContext& context) const {
  const std::string token_now = token();
  if (!token_now.empty()) context.AddMetadata(kTokenKey, token_now);
}

void LeaseKeeper::keep(const v1::LeaseGrant& grant) {
  const std::lock_guard lock(mutex_);
  token_ = grant.token();
  ttl_ = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double>(grant.lease().ttl_s()));
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  changed_.notify_all();
}

void LeaseKeeper::give_back() {
  grpc::ClientContext context;
  {
    const std::lock_guard lock(mutex_);
    if (ttl_ == std::chrono::nanoseconds::zero()) return;
    context.AddMetadata(kTokenKey, token_);
    token_.clear();
    ttl_ = std::chrono::nanoseconds::zero();
  }
  set_timeout(context, kReturnTimeout);
  v1::ReturnLeaseResponse answer;
  (void)stub_->ReturnLease(&context, {}, &answer);
}

// A lease that is over is not renewed; the next command hears why.
void LeaseKeeper::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    if (ttl_ == std::chrono::nanoseconds::zero()) {
      changed_.wait(lock);
      continue;
    }
    const std::string kept = token_;
    const auto pause = ttl_ / 3;
    changed_.wait_for(lock, pause, [&] { return ending_ || token_ != kept; });
    if (ending_ || token_ != kept) continue;
    lock.unlock();
    grpc::ClientContext context;
    context.AddMetadata(kTokenKey, kept);
    set_timeout(context, pause);
    v1::Lease lease;
    const grpc::Status status = stub_->RenewLease(&context, {}, &lease);
    lock.lock();
    if (status.error_code() == grpc::StatusCode::ABORTED && token_ == kept)
      ttl_ = std::chrono::nanoseconds::zero();
  }
}

}  // namespace hapticd::client
