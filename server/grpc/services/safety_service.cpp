#include "server/grpc/services/safety_service.h"

#include <fmt/format.h>

#include "server/grpc/calls/call.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/calls/stop_request.h"
#include "server/grpc/messages/enums.h"
#include "server/grpc/messages/status.h"
#include "server/process/log.h"
#include "server/session/safety_latch.h"

namespace hapticd::server {

grpc::Status SafetyService::stop(const grpc::CallbackServerContext& context, const grpc::ByteBuffer* request,
                                 grpc::ByteBuffer& response) {
  const std::uint64_t last_tick = latch_.stop();  // before anything that could fail or take long
  const StopReason reason =
      request != nullptr ? read_stop_request(*request) : StopReason{{}, {"the request did not come"}};
  v1::StopResponse answer;
  for (const std::string& repair : reason.repairs) answer.add_repairs(repair);
  answer.set_guard_fault(to_proto(latch_.fault_after_stop()));
  answer.set_guard_state(v1::GUARD_STATE_LATCHED);
  answer.set_latched_after_tick(last_tick);
  text::ReportRate& rate = reason.repairs.empty() ? noted_ : noted_unreadable_;
  if (const auto unreported = rate.take(std::chrono::steady_clock::now())) {
    note_stop(reason, *unreported, last_tick, context);
  }
  bool own_buffer = false;
  return grpc::SerializationTraits<v1::StopResponse>::Serialize(answer, &response, &own_buffer);
}

void SafetyService::note_stop(const StopReason& reason, std::uint64_t unreported, std::uint64_t last_tick,
                              const grpc::CallbackServerContext& context) {
  ServedCall* call = served_call();
  const std::string more = unreported == 0 ? "" : fmt::format(" (and {} more before)", unreported);
  std::string line = fmt::format("stopped by {}: {}",
                                 call == nullptr ? context.peer() : call->who.name + " at " + call->who.peer,
                                 reason.text.empty() ? "no reason given" : reason.text);
  for (const std::string& repair : reason.repairs) line += fmt::format(" ({})", repair);
  log_warning(line + more);
  if (call == nullptr) return;
  call->arguments = fmt::format("reason: \"{}\"{}", reason.text, more);
  call->note_end(grpc::Status::OK, last_tick);
}

grpc::ServerUnaryReactor* SafetyService::Clear(grpc::CallbackServerContext* context, const v1::ClearRequest*,
                                               v1::ClearResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  ServedCall call = served_call() == nullptr ? ServedCall{} : *served_call();
  const bool served = clears_.serve([this, context, response, reactor, call]() mutable {
    const ServedCallScope scope(call);
    const auto cleared = latch_.clear(caller_of(*context));
    if (cleared) {
      log_call("the guard was cleared", *context);
      response->set_guard_state(to_proto(cleared->state));
      response->set_cleared_fault(to_proto(cleared->fault));
      response->set_effective_tick(cleared->effective_tick);
    }
    const grpc::Status status = cleared ? grpc::Status::OK : to_status(cleared.refusal());
    call.note_end(status, response->effective_tick());
    reactor->Finish(status);
  });
  if (!served) {
    reactor->Finish(
        to_status({RefusalKind::kResourceExhausted,
                   {"too many clears at once", "SafetyService.Clear", "",
                    fmt::format("{} that wait", WaitQueue::kMaxWaiting), "one of them is enough"}}));
  }
  return reactor;
}

grpc::Status SafetyService::ListFaults(grpc::ServerContext*, const v1::ListFaultsRequest*,
                                       v1::ListFaultsResponse* response) {
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    v1::FaultRule& reported = *response->add_faults();
    reported.set_fault(to_proto(rule.fault));
    reported.set_cause(std::string(rule.cause));
    reported.set_action(to_proto(rule.action));
    reported.set_clearing(to_proto(rule.clearing));
    reported.set_remedy(std::string(rule.remedy));
  }
  return grpc::Status::OK;
}

}  // namespace hapticd::server
