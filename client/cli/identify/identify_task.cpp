#include "client/cli/identify/identify_task.h"

#include <charconv>
#include <cmath>
#include <utility>

#include "client/cli/identify/identify_upload.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

[[noreturn]] void refuse_column(const std::string& text, const std::string& what) {
  throw LocalError(what, "--column", text, "quantity=NAME[:unit[:scale]]",
                   "e.g. force=fz_n, force=Fz:N or force=Fz:mN:-1");
}

/// "force=Fz:mN:-1". NAME and unit may be empty: the daemon then finds them by itself.
std::pair<std::string, v1::RecordingColumn> parse_column(const std::string& text) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0)
    refuse_column(text, "the quantity of the column is missing");
  v1::RecordingColumn column;
  std::string rest = text.substr(equals + 1);
  if (rest.empty()) refuse_column(text, "the column is missing");
  const auto next_part = [&rest] {
    const auto colon = rest.find(':');
    std::string part = rest.substr(0, colon);
    rest = colon == std::string::npos ? std::string() : rest.substr(colon + 1);
    return part;
  };
  column.set_column(next_part());
  column.set_unit(next_part());
  if (rest.empty()) return {text.substr(0, equals), column};
  double scale = 0.0;
  const auto [end, failure] = std::from_chars(rest.data(), rest.data() + rest.size(), scale);
  if (failure != std::errc{} || end != rest.data() + rest.size() || !std::isfinite(scale) || scale == 0.0) {
    refuse_column(text, "the scale is not a number other than zero");
  }
  column.set_scale(scale);
  return {text.substr(0, equals), column};
}

v1::ContactLaw law_of(const std::string& word) {
  if (word == "hunt_crossley") return v1::CONTACT_LAW_HUNT_CROSSLEY;
  if (word == "creep") return v1::CONTACT_LAW_CREEP;
  return v1::CONTACT_LAW_UNSPECIFIED;
}

v1::ContactMethod method_of(const std::string& word) {
  if (word == "recursive") return v1::CONTACT_METHOD_RECURSIVE;
  if (word == "batch") return v1::CONTACT_METHOD_BATCH;
  return v1::CONTACT_METHOD_UNSPECIFIED;
}

void fill_contact(const IdentifyTask& task, v1::ContactTask& contact) {
  contact.set_law(law_of(task.law));
  contact.set_method(method_of(task.method));
  if (task.force_n) contact.set_force_n(*task.force_n);
  if (task.displacement_mm) contact.set_displacement_mm(*task.displacement_mm);
  if (task.speed_mm_per_s) contact.set_speed_mm_per_s(*task.speed_mm_per_s);
}

void fill_inclusion(const IdentifyTask& task, v1::InclusionTask& inclusion) {
  inclusion.set_reference_model(task.reference_model);
  if (task.reach_mm) inclusion.set_reach_mm(*task.reach_mm);
  if (task.spacing_mm) inclusion.set_spacing_mm(*task.spacing_mm);
  if (task.displacement_mm) inclusion.set_displacement_mm(*task.displacement_mm);
  if (task.known_depth_mm) inclusion.set_known_depth_mm(*task.known_depth_mm);
  if (task.tip_radius_mm) inclusion.set_tip_radius_mm(*task.tip_radius_mm);
}

void fill_vector(const std::vector<double>& components, v1::Vector3& vector) {
  vector.set_x(components.at(0));
  vector.set_y(components.at(1));
  vector.set_z(components.at(2));
}

}  // namespace

v1::StartIdentificationRequest start_request(IdentifyKind kind, const IdentifyTask& task) {
  v1::StartIdentificationRequest request;
  request.set_object(task.object);
  if (task.time_limit_s) request.set_time_limit_s(*task.time_limit_s);
  request.set_adopt(task.adopt);
  if (!task.press_direction.empty()) fill_vector(task.press_direction, *request.mutable_press_direction());
  if (!task.line_direction.empty()) fill_vector(task.line_direction, *request.mutable_line_direction());
  switch (kind) {
    case IdentifyKind::kContact:
      fill_contact(task, *request.mutable_contact());
      break;
    case IdentifyKind::kFriction:
      request.mutable_friction()->set_tip(task.tip);
      if (task.length_mm) request.mutable_friction()->set_length_mm(*task.length_mm);
      break;
    case IdentifyKind::kStructuralStiffness:
      request.mutable_structural_stiffness()->set_constant(task.constant);
      request.mutable_structural_stiffness()->set_rigid_contact(task.rigid_contact);
      if (task.least_object_stiffness_n_per_mm) {
        request.mutable_structural_stiffness()->set_least_object_stiffness_n_per_mm(
            *task.least_object_stiffness_n_per_mm);
      }
      break;
    case IdentifyKind::kTool:
      request.mutable_tool();
      break;
    case IdentifyKind::kThreshold:
      request.mutable_threshold();
      if (task.duration_s) request.mutable_threshold()->set_duration_s(*task.duration_s);
      break;
    case IdentifyKind::kGains:
      request.mutable_gains();
      if (task.target_stiffness_n_per_mm) {
        request.mutable_gains()->set_target_stiffness_n_per_mm(*task.target_stiffness_n_per_mm);
      }
      break;
    case IdentifyKind::kInclusion:
      fill_inclusion(task, *request.mutable_inclusion());
      break;
  }
  return request;
}

v1::RecordingDescription recording_description(const IdentifyTask& task) {
  v1::RecordingDescription description;
  description.set_name(recording_name(task.recording_path));
  for (const std::string& text : task.columns) {
    const auto [quantity, column] = parse_column(text);
    if (description.columns().contains(quantity)) {
      refuse_column(text, "there is a column for this quantity already");
    }
    (*description.mutable_columns())[quantity] = column;
  }
  description.set_decimal_comma(task.decimal_comma);
  if (task.normal_force_n) description.set_normal_force_n(*task.normal_force_n);
  return description;
}

}  // namespace hapticd::cli
