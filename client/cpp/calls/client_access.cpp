// Access, control of the rig, watchdog; clocks.

#include <optional>

#include "client/cpp/client.h"
#include "client/cpp/client_state.h"
#include "client/cpp/stop/late_stop.h"

namespace hapticd::client {
namespace {

/// Notice of a holder from which the lease is taken.
constexpr std::chrono::seconds kLongestNotice{10};

}  // namespace

v1::Access Client::access() {
  return state_->call(&v1::AccessService::Stub::GetAccess, v1::GetAccessRequest());
}

v1::OpenConsoleResponse Client::open_console() {
  return state_->call(&v1::AccessService::Stub::OpenConsole, v1::OpenConsoleRequest());
}

v1::LeaseState Client::lease() {
  return state_->call(&v1::LeaseService::Stub::GetLease, v1::GetLeaseRequest());
}

v1::LeaseGrant Client::acquire_lease(const v1::AcquireLeaseRequest& request) {
  const auto grant = state_->call(&v1::LeaseService::Stub::AcquireLease, request);
  state_->keeper->keep(grant);
  return grant;
}

v1::LeaseGrant Client::take_lease(const v1::TakeLeaseRequest& request) {
  const auto grant = state_->call(&v1::LeaseService::Stub::TakeLease, request, kLongestNotice);
  state_->keeper->keep(grant);
  return grant;
}

void Client::return_lease() {
  state_->keeper->give_back();
}

bool Client::holds_lease() const {
  return state_->keeper->holds();
}

v1::Watchdog Client::watchdog() {
  return state_->call(&v1::WatchdogService::Stub::GetWatchdog, v1::GetWatchdogRequest());
}

v1::CheckInResponse Client::check_in(const v1::CheckInRequest& request) {
  std::optional<LateStop> late;
  if (request.has_pressed() && !request.pressed()) late.emplace(state_->options);
  return state_->call(&v1::WatchdogService::Stub::CheckIn, request);
}

v1::ExchangeResponse Client::exchange_clocks(const v1::ExchangeRequest& request) {
  return state_->call(&v1::ClockService::Stub::Exchange, request);
}

v1::ClockState Client::clock() {
  return state_->call(&v1::ClockService::Stub::GetClock, v1::GetClockRequest());
}

PoseStream Client::subscribe_poses(const v1::SubscribePosesRequest& request) {
  return PoseStream(state_->stream(&v1::PoseService::Stub::AsyncSubscribe, request));
}

LeaseStream Client::watch_lease() {
  return LeaseStream(state_->stream(&v1::LeaseService::Stub::AsyncWatchLease, v1::WatchLeaseRequest()));
}

}  // namespace hapticd::client
