#include "server/grpc/services/rendering_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "server/grpc/calls/call.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"
#include "server/process/log.h"
#include "server/scene/target_control.h"
#include "server/telemetry/telemetry_hub.h"

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

constexpr const char* kLawPlace = "SetTargetRequest.law";

Refusal not_a_law(const char* what, const char* remedy) {
  return {RefusalKind::kInvalidArgument, {what, kLawPlace, "", "", remedy}};
}

hal::Vector3 vector(const v1::Vector3& message) {
  return {message.x(), message.y(), message.z()};
}

/// Reads a profile. If there are more knots than a law holds, their count is kept, and the check of the law
/// refuses it.
void read_profile(const v1::StiffnessProfile& profile, rt::TargetLaw& law) {
  law.knot_count = static_cast<std::uint32_t>(profile.knots_size());
  const int kept = std::min(profile.knots_size(), static_cast<int>(law.knots.size()));
  for (int i = 0; i < kept; ++i) {
    const v1::StiffnessProfile::Knot& knot = profile.knots(i);
    law.knots[static_cast<std::size_t>(i)] = {knot.at_mm(), knot.stiffness_n_per_mm()};
  }
  if (profile.has_axis()) law.axis = vector(profile.axis());
}

Outcome<rt::TargetLaw> law_of(const v1::SetTargetRequest& request) {
  using Kind = rt::TargetLaw::Kind;
  if (!request.has_law() && !request.has_stiffness_n_per_mm()) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"no target is given", "SetTargetRequest", "", "stiffness_n_per_mm or law",
                    "give one of them; 0 N/mm has to be said"}};
  }
  if (!request.has_law()) return rt::linear_target(request.stiffness_n_per_mm());
  if (request.has_stiffness_n_per_mm()) {
    return not_a_law("both a stiffness and a law are given", "give one of them");
  }
  rt::TargetLaw law;
  switch (request.law().kind_case()) {
    case v1::TargetLaw::kLinearNPerMm:
      return rt::linear_target(request.law().linear_n_per_mm());
    case v1::TargetLaw::kHuntCrossley: {
      const v1::HuntCrossleyLaw& power = request.law().hunt_crossley();
      law.kind = Kind::kHuntCrossley;
      law.hunt_crossley = {power.stiffness_n_per_mm_m(), power.damping_n_s_per_mm_m1(), power.exponent()};
      return law;
    }
    case v1::TargetLaw::kDisplacementProfile:
      if (request.law().displacement_profile().has_axis()) {
        return not_a_law("a displacement profile has no axis", "leave it out, or give a position profile");
      }
      law.kind = Kind::kDisplacementProfile;
      read_profile(request.law().displacement_profile(), law);
      return law;
    case v1::TargetLaw::kPositionProfile:
      law.kind = Kind::kPositionProfile;
      read_profile(request.law().position_profile(), law);
      return law;
    case v1::TargetLaw::KIND_NOT_SET:
      break;
  }
  return not_a_law("the target law is of no kind",
                   "give linear_n_per_mm, hunt_crossley, displacement_profile or position_profile");
}

}  // namespace

grpc::Status RenderingService::SetTarget(grpc::ServerContext* context, const v1::SetTargetRequest* request,
                                         v1::SetTargetResponse* response) {
  TargetRequest wanted;
  const auto law = law_of(*request);
  if (!law) return to_status(law.refusal());
  wanted.law = *law;
  wanted.at_time_ns = request->at_time_ns();
  if (request->has_ramp_s()) wanted.ramp_s = request->ramp_s();
  const auto set = targets_.set(wanted, caller_of(*context));
  if (!set) return to_status(set.refusal());
  const std::string line = log_.line(
      fmt::format("{:g} N/mm ({:g} asked for)", set->grant.granted_n_per_mm, set->requested_n_per_mm),
      served_call()->who.name + " at " + served_call()->who.peer, TargetLog::Clock::now());
  if (!line.empty()) log_info(line);
  response->set_requested_n_per_mm(set->requested_n_per_mm);
  response->set_granted_n_per_mm(set->grant.granted_n_per_mm);
  response->set_limiting_reason(to_proto(set->grant.reason));
  response->set_explanation(set->grant.explanation);
  response->set_effective_tick(set->effective_tick);
  response->set_effective_time_ns(set->effective_time_ns);
  response->set_ramp_s(set->ramp_s);
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
