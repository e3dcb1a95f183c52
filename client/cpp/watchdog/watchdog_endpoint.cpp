#include "client/cpp/watchdog/watchdog_endpoint.h"

#include <random>
#include <utility>

namespace hapticd::client {
namespace {

std::uint64_t random_sender() {
  std::random_device random;
  std::uint64_t sender = 0;
  while (sender == 0) sender = (std::uint64_t{random()} << 32U) | random();
  return sender;
}

}  // namespace

WatchdogEndpoint::WatchdogEndpoint(Client& client, std::string name)
    : client_(client), name_(std::move(name)), sender_(random_sender()) {}

void WatchdogEndpoint::begin(v1::CheckInRequest request) {
  request.set_nonce(0);
  const v1::CheckInResponse answer = client_.check_in(request);
  nonce_ = answer.nonce();
  timeout_ = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double, std::milli>(answer.timeout_ms()));
}

void WatchdogEndpoint::check_in(std::optional<bool> pressed) {
  v1::CheckInRequest request;
  request.set_endpoint(name_);
  request.set_sender(sender_);
  if (pressed) request.set_pressed(*pressed);
  const bool began = nonce_ == 0;
  if (began) begin(request);
  try {
    request.set_nonce(std::exchange(nonce_, 0));
    nonce_ = client_.check_in(request).nonce();
    return;
  } catch (const Error& error) {
    // The daemon was started again, or a copy of an old message arrived: one more try, with its nonce.
    if (began || error.code() != "ABORTED") throw;
  }
  begin(request);
  request.set_nonce(std::exchange(nonce_, 0));
  nonce_ = client_.check_in(request).nonce();
}

}  // namespace hapticd::client
