#include "server/grpc/messages/watchdog_messages.h"

namespace hapticd::server {

namespace {
constexpr v1::EndpointState to_proto(EndpointState state) {
  return static_cast<v1::EndpointState>(static_cast<int>(state) + 1);
}
static_assert(to_proto(EndpointState::kAwaited) == v1::ENDPOINT_STATE_AWAITED);
static_assert(to_proto(EndpointState::kMissing) == v1::ENDPOINT_STATE_MISSING);
}  // namespace

void fill(const EndpointView& view, v1::WatchdogEndpoint& message) {
  message.set_name(view.config.name);
  message.set_timeout_ms(view.config.timeout_ms);
  message.set_is_pedal(view.is_pedal);
  message.set_state(to_proto(view.state));
  message.set_silent_ms(view.silent_ms);
  message.set_checked_in_by(view.checked_in_by);
  message.set_check_ins(view.check_ins);
  message.set_wrong_nonces(view.wrong_nonces);
}

}  // namespace hapticd::server
