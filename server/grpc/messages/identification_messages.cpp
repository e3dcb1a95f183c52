#include "server/grpc/messages/identification_messages.h"

#include <cmath>

#include "server/grpc/messages/status.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr const char* kPlace = "StartIdentificationRequest";

Refusal invalid(const std::string& what, const std::string& field, const std::string& value,
                const std::string& limit) {
  return {RefusalKind::kInvalidArgument, {what, field, value, limit, "use one of those"}};
}

Outcome<identification::ContactTask> contact_task(const v1::ContactTask& wanted) {
  identification::ContactTask task;
  switch (wanted.law()) {
    case v1::CONTACT_LAW_UNSPECIFIED:
      break;
    case v1::CONTACT_LAW_HUNT_CROSSLEY:
      task.law = rt::ContactLawKind::kHuntCrossley;
      break;
    case v1::CONTACT_LAW_CREEP:
      task.law = rt::ContactLawKind::kCreep;
      break;
    default:
      return invalid("no such contact law", std::string(kPlace) + ".contact.law",
                     std::to_string(wanted.law()), "HUNT_CROSSLEY, CREEP");
  }
  switch (wanted.method()) {
    case v1::CONTACT_METHOD_UNSPECIFIED:
      break;
    case v1::CONTACT_METHOD_RECURSIVE:
      task.method = identification::ContactFitMethod::kRecursive;
      break;
    case v1::CONTACT_METHOD_BATCH:
      task.method = identification::ContactFitMethod::kBatch;
      break;
    default:
      return invalid("no such method", std::string(kPlace) + ".contact.method",
                     std::to_string(wanted.method()), "RECURSIVE, BATCH");
  }
  if (wanted.has_force_n()) task.force_n = wanted.force_n();
  if (wanted.has_displacement_mm()) task.displacement_mm = wanted.displacement_mm();
  if (wanted.has_speed_mm_per_s()) task.speed_mm_per_s = wanted.speed_mm_per_s();
  return task;
}

Outcome<identification::FrictionTask> friction_task(const v1::FrictionTask& wanted) {
  identification::FrictionTask task;
  if (wanted.tip() == "ball_bearing") {
    task.tip = rt::Tip::kBallBearing;
  } else if (wanted.tip() != "rod") {
    return invalid("no such tip", std::string(kPlace) + ".friction.tip", wanted.tip(), "rod, ball_bearing");
  }
  if (wanted.has_length_mm()) task.length_mm = wanted.length_mm();
  return task;
}

Outcome<IdentificationTask> structural_task(const v1::StructuralStiffnessTask& wanted) {
  identification::StructuralStiffnessTask task;
  task.constant = wanted.constant();
  task.rigid_contact = wanted.rigid_contact();
  if (wanted.has_least_object_stiffness_n_per_mm()) {
    if (!wanted.rigid_contact()) {
      return Refusal{RefusalKind::kInvalidArgument,
                     {"only a rigid contact has an object",
                      std::string(kPlace) + ".structural_stiffness.least_object_stiffness_n_per_mm", "", "",
                      "set rigid_contact, or leave it out"}};
    }
    task.least_object_stiffness_n_per_mm = wanted.least_object_stiffness_n_per_mm();
  }
  return IdentificationTask(task);
}

Outcome<IdentificationTask> task_of(const v1::StartIdentificationRequest& request) {
  using Case = v1::StartIdentificationRequest::TaskCase;
  switch (request.task_case()) {
    case Case::kContact: {
      auto task = contact_task(request.contact());
      if (!task) return task.refusal();
      return IdentificationTask(*task);
    }
    case Case::kFriction: {
      auto task = friction_task(request.friction());
      if (!task) return task.refusal();
      return IdentificationTask(*task);
    }
    case Case::kStructuralStiffness:
      return structural_task(request.structural_stiffness());
    case Case::kTool:
      return IdentificationTask(identification::ToolTask{});
    case Case::kThreshold: {
      identification::ThresholdTask task;
      if (request.threshold().has_duration_s()) task.duration_s = request.threshold().duration_s();
      return IdentificationTask(task);
    }
    case Case::kGains: {
      identification::GainsTask task;
      if (request.gains().has_target_stiffness_n_per_mm()) {
        task.target_stiffness_n_per_mm = request.gains().target_stiffness_n_per_mm();
      }
      return IdentificationTask(task);
    }
    case Case::kInclusion: {
      const v1::InclusionTask& asked = request.inclusion();
      identification::InclusionTask task;
      if (asked.has_reach_mm()) task.reach_mm = asked.reach_mm();
      if (asked.has_spacing_mm()) task.spacing_mm = asked.spacing_mm();
      if (asked.has_displacement_mm()) task.displacement_mm = asked.displacement_mm();
      if (asked.has_known_depth_mm()) task.known_depth_mm = asked.known_depth_mm();
      if (asked.has_tip_radius_mm()) task.tip_radius_mm = asked.tip_radius_mm();
      return IdentificationTask(task);
    }
    case Case::TASK_NOT_SET:
      break;
  }
  return Refusal{
      RefusalKind::kInvalidArgument,
      {"nothing to identify is named", kPlace, "",
       "contact, friction, structural_stiffness, tool, threshold, gains or inclusion", "set one of them"}};
}

v1::IdentificationState state_of(IdentificationState state) {
  switch (state) {
    case IdentificationState::kRunning:
      return v1::IDENTIFICATION_STATE_RUNNING;
    case IdentificationState::kConverged:
      return v1::IDENTIFICATION_STATE_CONVERGED;
    case IdentificationState::kPartial:
      return v1::IDENTIFICATION_STATE_PARTIAL;
    case IdentificationState::kCancelled:
      return v1::IDENTIFICATION_STATE_CANCELLED;
    case IdentificationState::kFailed:
      return v1::IDENTIFICATION_STATE_FAILED;
  }
  return v1::IDENTIFICATION_STATE_UNSPECIFIED;
}

void fill_axis(const identification::Coverage::Axis& axis, v1::CoverageMap::Axis& message) {
  message.set_quantity(axis.quantity);
  message.set_unit(axis.unit);
  message.set_from(axis.from);
  message.set_to(axis.to);
  message.set_bins(static_cast<std::uint32_t>(axis.bins));
}

}  // namespace

Outcome<IdentificationRequest> read_request(const v1::StartIdentificationRequest& request) {
  auto task = task_of(request);
  if (!task) return task.refusal();
  IdentificationRequest wanted;
  wanted.task = *task;
  wanted.object = request.object();
  wanted.recording = request.recording();
  wanted.reference_recording = request.inclusion().reference_recording();
  wanted.reference_model = request.inclusion().reference_model();
  wanted.time_limit_s =
      request.has_time_limit_s() ? request.time_limit_s() : default_time_limit_s(wanted.task);
  wanted.adopt = request.adopt();
  const auto vector_of = [](const v1::Vector3& v) { return hal::Vector3{v.x(), v.y(), v.z()}; };
  if (request.has_press_direction()) {
    wanted.geometry.press_direction = vector_of(request.press_direction());
  }
  if (request.has_line_direction()) wanted.geometry.line_direction = vector_of(request.line_direction());
  return wanted;
}

Outcome<RecordingDescription> read_description(const v1::RecordingDescription& message) {
  constexpr std::size_t kMaxName = 200;
  if (message.name().size() > kMaxName) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"the recording's name is too long", "RecordingDescription.name",
         std::to_string(message.name().size()) + " characters", "up to 200 characters", "shorten it"}};
  }
  RecordingDescription description;
  description.name = message.name();
  description.decimal_comma = message.decimal_comma();
  for (const auto& [quantity, column] : message.columns()) {
    replay::ColumnMapping& mapping = description.columns[quantity];
    mapping.column = column.column();
    mapping.unit = column.unit();
    if (column.has_scale()) mapping.scale = column.scale();
  }
  return description;
}

void fill(const IdentificationReport& report, v1::IdentificationProgress& message) {
  message.set_identification(report.id);
  message.set_kind(report.kind);
  message.set_object(report.object);
  message.set_recording(report.recording);
  message.set_state(state_of(report.state));
  message.set_model(report.model);
  if (report.problem) *message.mutable_problem() = to_detail(*report.problem);
  if (report.is_of_earlier_run) return;
  message.set_time_limit_s(report.time_limit_s);
  message.set_instruction(report.instruction);
  const identification::IdentificationProgress& progress = report.progress;
  message.set_duration_s(progress.duration_s);
  message.set_samples(progress.samples);
  for (const rt::EstimatedParameter& parameter : progress.parameters) {
    v1::EstimatedParameter& reported = *message.add_parameters();
    reported.set_name(parameter.name);
    reported.set_unit(parameter.unit);
    reported.set_value(parameter.value);
    reported.set_standard_error(parameter.standard_error);
  }
  if (std::isfinite(progress.residual)) message.set_residual(progress.residual);
  for (const identification::Coverage& coverage : progress.coverage) {
    v1::CoverageMap& map = *message.add_coverage();
    fill_axis(coverage.x, *map.mutable_x());
    fill_axis(coverage.y, *map.mutable_y());
    map.mutable_counts()->Add(coverage.counts.begin(), coverage.counts.end());
    for (const std::uint8_t required : coverage.required) map.add_required(required != 0);
    map.set_share(coverage.share);
    for (std::size_t cell = 0; cell < coverage.counts.size(); ++cell)
      map.add_enough(coverage.has_enough(cell));
  }
  message.set_fit_x(progress.fit_x);
  message.set_fit_y(progress.fit_y);
  for (const identification::FitPoint& point : progress.fit) {
    v1::FitPoint& reported = *message.add_fit();
    reported.set_x(point.x);
    reported.set_measured(point.measured);
    reported.set_model(point.model);
  }
  message.set_steady(progress.steady);
  message.set_certain(progress.certain);
  message.set_completion(progress.completion);
  for (const std::string& words : progress.missing) message.add_missing(repaired_utf8(words));
  for (const std::string& words : progress.remarks) message.add_remarks(repaired_utf8(words));
}

}  // namespace hapticd::server
