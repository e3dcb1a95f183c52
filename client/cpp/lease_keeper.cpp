#include "client/cpp/lease_keeper.h"

#include <pthread.h>

#include <algorithm>
#include <utility>

#include "client/cpp/error.h"

namespace hapticd::client {
namespace {

constexpr const char* kTokenKey = "hapticd-lease";
constexpr std::chrono::seconds kReturnTimeout{1};
constexpr std::size_t kTokenDigits = 32;
/// Range of a granted time to live, in s.
constexpr double kMinTtl = 0.01;
constexpr double kMaxTtl = 1e6;

/// gRPC ends the process for metadata that is not printable ASCII, so nothing else than a token goes there.
void check_token(const std::string& token, ErrorKind kind, const char* where) {
  const bool is_token = token.size() == kTokenDigits && std::all_of(token.begin(), token.end(), [](char c) {
                          return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f');
                        });
  if (is_token) return;
  v1::ErrorDetail detail;
  detail.set_what("the lease token is malformed");
  detail.set_where(where);
  detail.set_limit("32 digits 0 … 9, a … f");
  detail.set_remedy("use what acquiring the lease returned");
  throw Error(kind, "", detail);
}

void set_timeout(grpc::ClientContext& context, std::chrono::nanoseconds timeout) {
  context.set_deadline(std::chrono::system_clock::now() +
                       std::chrono::duration_cast<std::chrono::milliseconds>(timeout));
}

}  // namespace

LeaseKeeper::LeaseKeeper(std::shared_ptr<grpc::Channel> channel, std::string token)
    : stub_(v1::LeaseService::NewStub(std::move(channel))), token_(std::move(token)) {
  if (!token_.empty()) check_token(token_, ErrorKind::kRefused, "lease token");
}

LeaseKeeper::~LeaseKeeper() {
  give_back();
  {
    const MutexLock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::string LeaseKeeper::token() const {
  const MutexLock lock(mutex_);
  return token_;
}

bool LeaseKeeper::holds() const {
  const MutexLock lock(mutex_);
  return ttl_ > std::chrono::nanoseconds::zero() && std::chrono::steady_clock::now() - renewed_at_ < ttl_;
}

void LeaseKeeper::add_to(grpc::ClientContext& context) const {
  const std::string token_now = token();
  if (!token_now.empty()) context.AddMetadata(kTokenKey, token_now);
}

void LeaseKeeper::keep(const v1::LeaseGrant& grant) {
  check_token(grant.token(), ErrorKind::kUnreadable, "LeaseGrant.token");
  const double ttl_s = grant.lease().ttl_s();
  if (!(ttl_s >= kMinTtl && ttl_s <= kMaxTtl)) {
    v1::ErrorDetail detail;
    detail.set_what("the daemon granted a lease without a time to live");
    detail.set_where("LeaseGrant.lease.ttl_s");
    detail.set_value(std::to_string(ttl_s));
    throw Error(ErrorKind::kUnreadable, "", detail);
  }
  const MutexLock lock(mutex_);
  token_ = grant.token();
  ttl_ = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(ttl_s));
  renewed_at_ = std::chrono::steady_clock::now();
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
  changed_.notify_all();
}

void LeaseKeeper::give_back() {
  grpc::ClientContext context;
  {
    const MutexLock lock(mutex_);
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
  pthread_setname_np(pthread_self(), "lease-keeper");
  MutexLock lock(mutex_);
  while (!ending_) {
    if (ttl_ == std::chrono::nanoseconds::zero()) {
      changed_.wait(mutex_);
      continue;
    }
    const std::string kept = token_;
    const auto pause = ttl_ / 3;
    const auto due = std::chrono::steady_clock::now() + pause;
    while (!ending_ && token_ == kept && changed_.wait_until(mutex_, due)) {
    }
    if (ending_ || token_ != kept) continue;
    lock.unlock();
    grpc::ClientContext context;
    context.AddMetadata(kTokenKey, kept);
    set_timeout(context, pause);
    v1::Lease lease;
    const auto asked_at = std::chrono::steady_clock::now();
    const grpc::Status status = stub_->RenewLease(&context, {}, &lease);
    lock.lock();
    if (token_ != kept) continue;
    if (status.ok()) renewed_at_ = asked_at;
    if (status.error_code() == grpc::StatusCode::ABORTED) ttl_ = std::chrono::nanoseconds::zero();
  }
}

}  // namespace hapticd::client
