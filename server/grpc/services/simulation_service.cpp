#include "server/grpc/services/simulation_service.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "server/grpc/calls/call.h"
#include "server/grpc/messages/status.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/text/suggestion.h"

namespace hapticd::server {

namespace {

using Kind = sim::HandProgram::Kind;

std::optional<Kind> kind_of(v1::HandProgramKind kind) {
  switch (kind) {
    case v1::HAND_PROGRAM_KIND_REST:
      return Kind::kRest;
    case v1::HAND_PROGRAM_KIND_TAP:
      return Kind::kTap;
    case v1::HAND_PROGRAM_KIND_PRESS:
      return Kind::kPress;
    case v1::HAND_PROGRAM_KIND_STROKE:
      return Kind::kStroke;
    case v1::HAND_PROGRAM_KIND_WEIGHT:
      return Kind::kWeight;
    case v1::HAND_PROGRAM_KIND_SHAKE:
      return Kind::kShake;
    case v1::HAND_PROGRAM_KIND_FOLLOW:
      return Kind::kFollow;
    default:
      return std::nullopt;
  }
}

sim::HandProgram to_program(const v1::HandProgram& wanted, Kind kind) {
  sim::HandProgram program;
  program.kind = kind;
  if (wanted.has_force_n()) program.force_n = wanted.force_n();
  if (wanted.has_depth_mm()) program.depth_mm = wanted.depth_mm();
  if (wanted.has_force_rate_n_per_s()) program.force_rate_n_per_s = wanted.force_rate_n_per_s();
  if (wanted.has_approach_mm_per_s()) program.approach_mm_per_s = wanted.approach_mm_per_s();
  if (wanted.has_speed_mm_per_s()) program.speed_mm_per_s = wanted.speed_mm_per_s();
  if (wanted.has_rate_hz()) program.rate_hz = wanted.rate_hz();
  if (wanted.has_hold_s()) program.hold_s = wanted.hold_s();
  if (wanted.has_repetitions()) program.repetitions = wanted.repetitions();
  const auto vector = [](const v1::Vector3& message) {
    return hal::Vector3{message.x(), message.y(), message.z()};
  };
  if (wanted.has_stroke_direction()) program.stroke_direction = vector(wanted.stroke_direction());
  if (wanted.has_stroke_length_mm()) program.stroke_length_mm = wanted.stroke_length_mm();
  if (wanted.has_mass_g()) program.mass_g = wanted.mass_g();
  if (wanted.has_knock_n()) program.knock_n = wanted.knock_n();
  if (wanted.has_tilt_deg()) program.tilt_deg = wanted.tilt_deg();
  if (wanted.has_shake_direction()) program.shake_direction = vector(wanted.shake_direction());
  if (wanted.has_place_mm()) program.place_mm = vector(wanted.place_mm());
  if (wanted.has_tap_slant_deg()) program.tap_slant_deg = wanted.tap_slant_deg();
  return program;
}

std::vector<std::string> object_names() {
  std::vector<std::string> names = sim::SimulatedRig::object_presets();
  names.emplace_back("none");
  return names;
}

grpc::Status not_simulated(const Session& session) {
  return to_status({RefusalKind::kFailedPrecondition,
                    {"the rig is not simulated", "rig '" + session.rig_info().name + "'", "",
                     "a simulated rig", "start the daemon with --rig sim"},
                    Reason::kNotSimulated});
}

void describe(const Session& session, v1::SimulationInfo& info) {
  info.set_device(session.rig_info().device.model);
  info.set_object(session.simulation()->object());
  info.set_hand_is_done(session.simulation()->hand_is_done());
  for (const std::string& name : object_names()) info.add_objects(name);
  if (const auto object = sim::object_preset(info.object())) {
    info.set_object_stiffness_n_per_mm(object->material.stiffness_at_4n_n_per_mm);
  }
}

}  // namespace

grpc::Status SimulationService::GetSimulation(grpc::ServerContext*, const v1::GetSimulationRequest*,
                                              v1::SimulationInfo* response) {
  if (session_.simulation() == nullptr) return not_simulated(session_);
  describe(session_, *response);
  return grpc::Status::OK;
}

grpc::Status SimulationService::SetHandProgram(grpc::ServerContext* context,
                                               const v1::SetHandProgramRequest* request,
                                               v1::SetHandProgramResponse*) {
  if (session_.simulation() == nullptr) return not_simulated(session_);
  if (const auto refusal = scenes_.reserved()) return to_status(*refusal);  // the hand is busy
  const auto kind = kind_of(request->program().kind());
  if (!kind) {
    return to_status({RefusalKind::kInvalidArgument,
                      {"no such hand program", "SetHandProgramRequest.program.kind",
                       std::to_string(static_cast<int>(request->program().kind())),
                       "REST, TAP, PRESS, STROKE, WEIGHT, SHAKE", "use one of those"}});
  }
  if (auto error = session_.simulation()->set_program(to_program(request->program(), *kind))) {
    error->where = "SetHandProgramRequest.program";
    return to_status({RefusalKind::kInvalidArgument, *error});
  }
  constexpr std::string_view kPrefix = "HAND_PROGRAM_KIND_";
  log_call(
      "hand program " + v1::HandProgramKind_Name(request->program().kind()).substr(kPrefix.size()) + " begun",
      *context);
  return grpc::Status::OK;
}

grpc::Status SimulationService::SetObject(grpc::ServerContext* context, const v1::SetObjectRequest* request,
                                          v1::SetObjectResponse* response) {
  if (session_.simulation() == nullptr) return not_simulated(session_);
  if (const auto refusal = scenes_.reserved()) return to_status(*refusal);
  const std::vector<std::string> known = object_names();
  if (std::find(known.begin(), known.end(), request->name()) == known.end()) {
    return to_status({RefusalKind::kNotFound,
                      {"no such object", "SetObjectRequest.name", request->name(), comma_separated(known),
                       did_you_mean(request->name(), known, "use one of those")}});
  }
  if (const auto error = session_.simulation()->set_object(
          request->name(), {request->inclusion_x_mm(), request->inclusion_y_mm(), 0.0})) {
    return to_status({RefusalKind::kInvalidArgument, *error});
  }
  log_call("object '" + request->name() + "' put under the tool", *context);
  describe(session_, *response->mutable_simulation());
  return grpc::Status::OK;
}

}  // namespace hapticd::server
