#include "server/services/rendering_service.h"

#include "server/services/call.h"
#include "server/services/status.h"
#include "server/target_control.h"
#include "server/telemetry_hub.h"

namespace hapticd::server {

namespace {

v1::LimitingReason to_proto(LimitingReason reason) {
  switch (reason) {
    case LimitingReason::kNone:
      return v1::LIMITING_REASON_NONE;
    case LimitingReason::kSceneMaximum:
      return v1::LIMITING_REASON_SCENE_MAXIMUM;
    case LimitingReason::kStructuralStiffness:
      return v1::LIMITING_REASON_STRUCTURAL_STIFFNESS;
    case LimitingReason::kDeviceForce:
      return v1::LIMITING_REASON_DEVICE_FORCE;
  }
  return v1::LIMITING_REASON_UNSPECIFIED;
}

}  // namespace

grpc::Status RenderingService::SetTarget(grpc::ServerContext* context, const v1::SetTargetRequest* request,
                                         v1::SetTargetResponse* response) {
  TargetRequest wanted;
  wanted.stiffness_n_per_mm = request->stiffness_n_per_mm();
  wanted.at_time_ns = request->at_time_ns();
  if (request->has_ramp_s()) wanted.ramp_s = request->ramp_s();
  const auto set = targets_.set(wanted, caller_of(*context));
  if (!set) return to_status(set.refusal());
  response->set_requested_n_per_mm(wanted.stiffness_n_per_mm);
  response->set_granted_n_per_mm(set->grant.granted_n_per_mm);
  response->set_limiting_reason(to_proto(set->grant.reason));
  response->set_explanation(set->grant.explanation);
  response->set_effective_tick(set->effective_tick);
  response->set_effective_time_ns(set->effective_time_ns);
  return grpc::Status::OK;
}

grpc::Status RenderingService::GetFeasibleRange(grpc::ServerContext*,
                                                const v1::GetFeasibleRangeRequest* request,
                                                v1::FeasibleRange* response) {
  std::optional<double> hand_force_n;
  std::optional<double> object_stiffness;
  if (request->has_hand_force_n()) hand_force_n = request->hand_force_n();
  if (request->has_object_stiffness_n_per_mm()) object_stiffness = request->object_stiffness_n_per_mm();
  const auto range = targets_.feasible(hand_force_n, object_stiffness, hub_.latest());
  if (!range) return to_status(range.refusal());
  response->set_hand_force_n(range->hand_force_n);
  response->set_object_stiffness_n_per_mm(range->object_stiffness_n_per_mm);
  response->set_min_n_per_mm(range->min_n_per_mm);
  response->set_max_n_per_mm(range->max_n_per_mm);
  response->set_max_limited_by(to_proto(range->max_limited_by));
  response->set_device_max_force_n(range->device_max_force_n);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
