#include "server/grpc/services/turntable_service.h"

#include <cmath>

#include "hal/turntable.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/part_messages.h"
#include "server/grpc/messages/status.h"
#include "server/turntable/turntable_host.h"

namespace hapticd::server {

namespace {

// The contract's enums begin with an unspecified 0; then they have the values of the turntable's, plus one.
v1::TurntableState to_proto(hal::TurntableState state) {
  return static_cast<v1::TurntableState>(static_cast<int>(state) + 1);
}
static_assert(static_cast<int>(hal::TurntableState::kIdle) + 1 == v1::TURNTABLE_STATE_IDLE);
static_assert(static_cast<int>(hal::TurntableState::kStalled) + 1 == v1::TURNTABLE_STATE_STALLED);
static_assert(static_cast<int>(hal::TurntableState::kLost) + 1 == v1::TURNTABLE_STATE_LOST);

v1::TurntableMotionEnd to_proto(hal::MotionEnd end) {
  return static_cast<v1::TurntableMotionEnd>(static_cast<int>(end) + 1);
}
static_assert(static_cast<int>(hal::MotionEnd::kNone) + 1 == v1::TURNTABLE_MOTION_END_NONE);
static_assert(static_cast<int>(hal::MotionEnd::kMissed) + 1 == v1::TURNTABLE_MOTION_END_MISSED);
static_assert(static_cast<int>(hal::MotionEnd::kRefused) + 1 == v1::TURNTABLE_MOTION_END_REFUSED);

v1::TurntableMotionKind to_proto(hal::MotionKind kind) {
  return static_cast<v1::TurntableMotionKind>(static_cast<int>(kind) + 1);
}
static_assert(static_cast<int>(hal::MotionKind::kMove) + 1 == v1::TURNTABLE_MOTION_KIND_MOVE);

void fill(const hal::TurntableStatus& status, v1::TurntableStatus& message) {
  message.set_state(to_proto(status.state));
  if (status.position_deg) message.set_position_deg(*status.position_deg);
  if (std::isfinite(status.position_age_s)) message.set_position_age_s(status.position_age_s);
  message.set_velocity_deg_per_s(status.velocity_deg_per_s);
  message.set_homed(status.homed);
  message.set_station(status.station);
  message.set_alarm_code(status.alarm_code);
  message.set_alarm_text(printable(status.alarm_text));
  v1::TurntableMotion& motion = *message.mutable_motion();
  motion.set_number(status.motion.number);
  motion.set_kind(to_proto(status.motion.kind));
  motion.set_end(to_proto(status.motion.end));
  motion.set_stopping(status.motion.stopping);
  if (status.motion.target_deg) motion.set_target_deg(*status.motion.target_deg);
  motion.set_completion(status.motion.completion);
  motion.set_elapsed_s(status.motion.elapsed_s);
  motion.set_expected_s(status.motion.expected_s);
  if (status.motion.problem) *motion.mutable_problem() = to_detail(*status.motion.problem);
}

grpc::Status answer(const Outcome<hal::TurntableStatus>& outcome, v1::TurntableStatus* response) {
  if (!outcome) return to_status(outcome.refusal());
  fill(*outcome, *response);
  return grpc::Status::OK;
}

TurntableHost::Progress writing_to(grpc::ServerWriter<v1::TurntableStatus>& writer) {
  return [&writer](const hal::TurntableStatus& status) {
    v1::TurntableStatus message;
    fill(status, message);
    return writer.Write(message);
  };
}

}  // namespace

grpc::Status TurntableService::GetTurntable(grpc::ServerContext*, const v1::GetTurntableRequest*,
                                            v1::Turntable* response) {
  const hal::Turntable* table = host_.table();
  if (table == nullptr) {
    return to_status({RefusalKind::kFailedPrecondition,
                      {"this rig has no turntable", "turntable", "", "a rig with one",
                       "set kind in [rig.turntable] of the configuration"},
                      Reason::kNoHardware});
  }
  const hal::TurntableInfo& info = table->info();
  response->set_name(info.name);
  response->set_min_deg(info.min_deg);
  response->set_max_deg(info.max_deg);
  response->set_max_speed_deg_per_s(info.limits.speed_deg_per_s);
  response->set_max_acceleration_deg_per_s2(info.limits.acceleration_deg_per_s2);
  response->set_tolerance_deg(info.tolerance_deg);
  response->set_stale_after_s(info.stale_after_s);
  for (const hal::TurntableStation& station : info.stations) {
    v1::TurntableStation& reported = *response->add_stations();
    reported.set_name(station.name);
    reported.set_angle_deg(station.angle_deg);
    reported.set_object(station.object);
  }
  fill(table->status(), *response->mutable_status());
  if (const auto why_not = host_.interlock()) *response->mutable_interlock() = to_detail(*why_not);
  fill_report(table->report(), *response);
  return grpc::Status::OK;
}

grpc::Status TurntableService::Home(grpc::ServerContext* context, const v1::HomeRequest*,
                                    grpc::ServerWriter<v1::TurntableStatus>* writer) {
  const auto end = host_.home(caller_of(*context), writing_to(*writer));
  return end ? grpc::Status::OK : to_status(end.refusal());
}

grpc::Status TurntableService::MoveTo(grpc::ServerContext* context, const v1::MoveToRequest* request,
                                      grpc::ServerWriter<v1::TurntableStatus>* writer) {
  TurntableDestination destination;
  switch (request->destination_case()) {
    case v1::MoveToRequest::kAngleDeg:
      destination.angle_deg = request->angle_deg();
      break;
    case v1::MoveToRequest::kStation:
      destination.station = request->station();
      break;
    case v1::MoveToRequest::DESTINATION_NOT_SET:
      return to_status(
          {RefusalKind::kInvalidArgument,
           {"no destination is given", "MoveToRequest.destination", "", "angle_deg or station", "give one"}});
  }
  const hal::MotionLimits limits{request->speed_deg_per_s(), request->acceleration_deg_per_s2()};
  const bool zero = (request->has_speed_deg_per_s() && limits.speed_deg_per_s == 0.0) ||
                    (request->has_acceleration_deg_per_s2() && limits.acceleration_deg_per_s2 == 0.0);
  if (zero) {
    return to_status(
        {RefusalKind::kOutOfRange,
         {"the limit of the motion is zero", "MoveToRequest", "0", "above 0", "leave it out, or give one"}});
  }
  const auto end = host_.move_to(destination, limits, caller_of(*context), writing_to(*writer));
  return end ? grpc::Status::OK : to_status(end.refusal());
}

grpc::ServerUnaryReactor* TurntableService::StopTurntable(grpc::CallbackServerContext* context,
                                                          const v1::StopTurntableRequest*,
                                                          v1::TurntableStatus* response) {
  return finish(*context, answer(host_.stop(), response));
}

grpc::Status TurntableService::ClearAlarm(grpc::ServerContext* context, const v1::ClearAlarmRequest*,
                                          v1::TurntableStatus* response) {
  return answer(host_.clear_alarm(caller_of(*context)), response);
}

grpc::Status TurntableService::Engage(grpc::ServerContext*, const v1::EngageRequest*,
                                      v1::TurntableStatus* response) {
  return answer(host_.engage(), response);
}

grpc::Status TurntableService::Disengage(grpc::ServerContext*, const v1::DisengageRequest*,
                                         v1::TurntableStatus* response) {
  return answer(host_.disengage(), response);
}

}  // namespace hapticd::server
