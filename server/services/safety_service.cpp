#include "server/services/safety_service.h"

#include "server/safety_latch.h"
#include "server/services/call.h"
#include "server/services/enums.h"
#include "server/services/status.h"

namespace hapticd::server {

grpc::ServerUnaryReactor* SafetyService::Stop(grpc::CallbackServerContext* context,
                                              const v1::StopRequest* request, v1::StopResponse* response) {
  response->set_guard_fault(to_proto(latch_.stop(request->reason())));
  response->set_guard_state(v1::GUARD_STATE_LATCHED);
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::Status SafetyService::Clear(grpc::ServerContext* context, const v1::ClearRequest*,
                                  v1::ClearResponse* response) {
  const auto cleared = latch_.clear(caller_of(*context));
  if (!cleared) return to_status(cleared.refusal());
  response->set_guard_state(to_proto(cleared->state));
  response->set_cleared_fault(to_proto(cleared->fault));
  response->set_effective_tick(cleared->effective_tick);
  return grpc::Status::OK;
}

grpc::Status SafetyService::ListFaults(grpc::ServerContext*, const v1::ListFaultsRequest*,
                                       v1::ListFaultsResponse* response) {
  for (const rt::FaultRule& rule : rt::kFaultTable) {
    v1::FaultRule& told = *response->add_faults();
    told.set_fault(to_proto(rule.fault));
    told.set_cause(std::string(rule.cause));
    told.set_action(to_proto(rule.action));
    told.set_clearing(to_proto(rule.clearing));
    told.set_remedy(std::string(rule.remedy));
  }
  return grpc::Status::OK;
}

}  // namespace hapticd::server
