#include "server/grpc/experiment/guide_service.h"

#include "server/grpc/calls/call.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/messages/telemetry_messages.h"
#include "server/guide/guide_host.h"

namespace hapticd::server {

namespace {

// The contract's enum has no value for "there was none yet": a status has one.
static_assert(static_cast<int>(rt::GuideState::kUnderWay) == v1::GUIDE_STATE_UNDER_WAY);
static_assert(static_cast<int>(rt::GuideState::kArrived) == v1::GUIDE_STATE_ARRIVED);
static_assert(static_cast<int>(rt::GuideState::kForceCut) == v1::GUIDE_STATE_FORCE_CUT);

void fill_status(const GuideHost::Status& status, v1::GuideStatus& message) {
  const rt::TickRecord& record = status.record;
  message.set_number(record.guide_number);
  message.set_state(static_cast<v1::GuideState>(record.guide_state));
  fill_vector(record.tip_position_mm, *message.mutable_position_mm());
  fill_vector(status.goal_mm, *message.mutable_goal_mm());
  fill_vector(record.guide_force_n, *message.mutable_force_n());
  message.set_tick(record.tick);
}

}  // namespace

grpc::Status GuideService::MoveTool(grpc::ServerContext* context, const v1::MoveToolRequest* request,
                                    grpc::ServerWriter<v1::GuideStatus>* writer) {
  ToolDestination destination;
  switch (request->destination_case()) {
    case v1::MoveToolRequest::kPointMm:
      destination.point_mm = {request->point_mm().x(), request->point_mm().y(), request->point_mm().z()};
      break;
    case v1::MoveToolRequest::kAboveStation:
      destination.above_station = request->above_station();
      break;
    case v1::MoveToolRequest::kUntilContactMm:
      destination.until_contact_mm = request->until_contact_mm();
      break;
    case v1::MoveToolRequest::DESTINATION_NOT_SET:
      break;
  }
  if (request->has_max_speed_mm_per_s()) destination.max_speed_mm_per_s = request->max_speed_mm_per_s();
  if (request->has_max_force_n()) destination.max_force_n = request->max_force_n();
  if (request->has_timeout_s()) destination.timeout_s = request->timeout_s();
  const auto end = host_.move(destination, caller_of(*context), [writer](const GuideHost::Status& status) {
    v1::GuideStatus message;
    fill_status(status, message);
    return writer->Write(message);
  });
  return end ? grpc::Status::OK : to_status(end.refusal());
}

}  // namespace hapticd::server
