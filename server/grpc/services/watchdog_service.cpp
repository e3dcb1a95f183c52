#include "server/grpc/services/watchdog_service.h"

#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/messages/watchdog_messages.h"
#include "server/text/utf8_text.h"
#include "server/watchdog/watchdog.h"

namespace hapticd::server {

namespace {
constexpr std::size_t kMaxEndpointName = 64;
}

grpc::ServerUnaryReactor* WatchdogService::CheckIn(grpc::CallbackServerContext* context,
                                                   const v1::CheckInRequest* request,
                                                   v1::CheckInResponse* response) {
  CheckInRecord record{request->endpoint(), request->sender(), request->nonce(), std::nullopt, ""};
  if (request->has_pressed()) record.pressed = request->pressed();
  if (const ServedCall* call = served_call()) record.who = call->who.name;
  const auto answer = watchdog_.check_in(record);
  if (answer) {
    response->set_nonce(answer->nonce);
    response->set_counted(answer->counted);
    response->set_timeout_ms(answer->timeout_ms);
  }
  if (ServedCall* call = served_call()) {
    call->arguments = "endpoint: \"" + shortened(request->endpoint(), kMaxEndpointName) + "\"";
  }
  return finish(*context, answer ? grpc::Status::OK : to_status(answer.refusal()));
}

grpc::Status WatchdogService::GetWatchdog(grpc::ServerContext*, const v1::GetWatchdogRequest*,
                                          v1::Watchdog* response) {
  for (const EndpointView& view : watchdog_.views()) fill(view, *response->add_endpoints());
  return grpc::Status::OK;
}

}  // namespace hapticd::server
