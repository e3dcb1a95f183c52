#include "server/grpc/calibration/calibration_messages.h"

#include <fmt/format.h>

#include "server/grpc/messages/status.h"

namespace hapticd::server {

namespace {

using calibration::CalibrationKind;

// The contract's enums begin with an unspecified 0; then they have the values of the daemon's, plus one.
v1::CalibrationKind to_proto(CalibrationKind kind) {
  return static_cast<v1::CalibrationKind>(static_cast<int>(kind) + 1);
}
static_assert(static_cast<int>(CalibrationKind::kTip) + 1 == v1::CALIBRATION_KIND_TIP);
static_assert(static_cast<int>(CalibrationKind::kKinematics) + 1 == v1::CALIBRATION_KIND_KINEMATICS);
v1::CalibrationState to_proto(CalibrationState state) {
  return static_cast<v1::CalibrationState>(static_cast<int>(state) + 1);
}
static_assert(static_cast<int>(CalibrationState::kRecording) + 1 == v1::CALIBRATION_STATE_RECORDING);
static_assert(static_cast<int>(CalibrationState::kFailed) + 1 == v1::CALIBRATION_STATE_FAILED);

void fill_vector(const Eigen::Vector3d& v, v1::Vector3& message) {
  message.set_x(v.x());
  message.set_y(v.y());
  message.set_z(v.z());
}
void fill_transform(const rt::RigidTransform& t, v1::RigidTransform& message) {
  message.mutable_rotation()->set_w(t.rotation.w());
  message.mutable_rotation()->set_x(t.rotation.x());
  message.mutable_rotation()->set_y(t.rotation.y());
  message.mutable_rotation()->set_z(t.rotation.z());
  fill_vector(t.translation_mm, *message.mutable_translation_mm());
}
Eigen::Vector3d vector_of(const v1::Vector3& v) {
  return {v.x(), v.y(), v.z()};
}
Eigen::Quaterniond quaternion_of(const v1::Quaternion& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}
Refusal invalid(const char* what, const char* where, std::string value, const char* limit) {
  return {RefusalKind::kInvalidArgument, {what, where, std::move(value), limit, ""}};
}

}  // namespace

Outcome<CalibrationRequest> read_request(const v1::StartCalibrationRequest& request) {
  CalibrationRequest wanted;
  if (request.kind() < v1::CALIBRATION_KIND_TIP || request.kind() > v1::CALIBRATION_KIND_KINEMATICS) {
    return invalid("what is to be calibrated is not said", "StartCalibrationRequest.kind",
                   std::to_string(request.kind()), "TIP, REGISTRATION or KINEMATICS");
  }
  wanted.kind = static_cast<CalibrationKind>(static_cast<int>(request.kind()) - 1);
  if (request.has_time_limit_s()) wanted.time_limit_s = request.time_limit_s();
  if (!(wanted.time_limit_s >= 1.0 && wanted.time_limit_s <= 1800.0)) {
    return Refusal{RefusalKind::kOutOfRange,
                   {"the time limit is out of range", "StartCalibrationRequest.time_limit_s",
                    fmt::format("{}", wanted.time_limit_s), "1 … 1800 s", ""}};
  }
  wanted.own_clock = request.own_clock();
  wanted.recorded = request.recorded();
  wanted.simulated_tracker = request.simulated_tracker();
  wanted.tip_calibration = request.tip_calibration();
  wanted.adopt = request.adopt();
  if (wanted.recorded && wanted.simulated_tracker) {
    return invalid("a simulated tracker watches the live rig", "StartCalibrationRequest.simulated_tracker",
                   "true", "false with a recording");
  }
  return wanted;
}

Outcome<std::vector<calibration::ReferencePose>> read_poses(const v1::PushReferencePosesRequest& request) {
  std::vector<calibration::ReferencePose> poses;
  for (const v1::ReferencePose& p : request.poses()) {
    if (!p.has_position_mm()) {
      return invalid("a pose has no position", "ReferencePose.position_mm", "", "three coordinates, mm");
    }
    calibration::ReferencePose pose;
    pose.stamp_s = 1e-9 * static_cast<double>(p.stamp_ns());
    pose.position_mm = vector_of(p.position_mm());
    if (p.has_orientation()) pose.orientation = quaternion_of(p.orientation());
    poses.push_back(pose);
  }
  return poses;
}

Outcome<std::vector<calibration::RigPose>> read_rig_poses(const v1::PushReferencePosesRequest& request) {
  std::vector<calibration::RigPose> poses;
  for (const v1::RecordedRigPose& p : request.rig_poses()) {
    const bool with_angles = p.joint_rad_size() == 3 && p.gimbal_rad_size() == 3;
    if (!with_angles && (p.joint_rad_size() != 0 || p.gimbal_rad_size() != 0)) {
      return invalid("a pose has not three angles of joints and three of the gimbal",
                     "RecordedRigPose.joint_rad", std::to_string(p.joint_rad_size()), "3 and 3, or none");
    }
    calibration::RigPose pose;
    pose.time_s = 1e-9 * static_cast<double>(p.time_ns());
    pose.tip_mm = vector_of(p.tip_mm());
    pose.orientation = quaternion_of(p.orientation());
    if (!(std::abs(pose.orientation.norm() - 1.0) < 1e-3)) {
      return invalid("an orientation is none", "RecordedRigPose.orientation", "", "a quaternion of length 1");
    }
    pose.orientation.normalize();
    pose.angles.known = with_angles;
    for (int i = 0; with_angles && i < 3; ++i) {
      pose.angles.joint_rad[static_cast<std::size_t>(i)] = p.joint_rad(i);
      pose.angles.gimbal_rad[static_cast<std::size_t>(i)] = p.gimbal_rad(i);
    }
    poses.push_back(pose);
  }
  return poses;
}

void fill(const CalibrationReport& report, v1::CalibrationProgress& message) {
  message.set_calibration(report.id);
  message.set_kind(to_proto(report.kind));
  message.set_state(to_proto(report.state));
  message.set_duration_s(report.duration_s);
  message.set_time_limit_s(report.time_limit_s);
  message.set_reference_poses(report.reference_poses);
  message.set_rig_poses(report.rig_poses);
  message.set_completion(report.completion);
  message.set_instruction(report.instruction);
  for (const auto& item : report.coverage) {
    auto& covered = *message.add_coverage();
    covered.set_name(item.name);
    covered.set_unit(item.unit);
    covered.set_value(item.value);
    covered.set_required(item.required);
    covered.set_instruction(item.instruction);
  }
  message.set_stored(report.stored);
  if (report.problem) *message.mutable_problem() = to_detail(*report.problem);
}

void fill(const StoredCalibration& stored, bool adopted, v1::Calibration& message) {
  const auto& fit = stored.fit;
  message.set_hash(stored.hash);
  message.set_kind(to_proto(stored.kind));
  message.set_created(stored.created);
  message.set_rig(stored.rig);
  message.set_adopted(adopted);
  message.set_poses(fit.poses);
  message.set_outliers(fit.outliers);
  message.set_fiducial_residual_mm(fit.residual_rms_mm);
  if (stored.tip_in_marker_mm) fill_vector(*stored.tip_in_marker_mm, *message.mutable_tip_in_marker_mm());
  if (stored.kind == CalibrationKind::kTip) return;
  fill_transform(fit.calibration.reference_from_rig, *message.mutable_reference_from_rig());
  fill_transform(fit.tool_from_marker, *message.mutable_tool_from_marker());
  message.set_latency_ms(1e3 * fit.latency_s);
  message.set_latency_standard_error_ms(1e3 * fit.latency_sd_s);
  message.set_clock_drift_ppm(1e6 * fit.clock_drift);
  message.set_tracker_noise_mm(fit.tracker_noise_mm);
  message.set_left_out_mm(fit.left_out_rms_mm);
  message.set_left_out_place_mm(fit.left_out_place_rms_mm);
  message.set_predicted_target_error_median_mm(fit.predicted_median_mm);
  message.set_predicted_target_error_95_mm(fit.predicted_95_mm);
  message.set_predicted_orientation_error_deg(rt::kDegPerRad * fit.predicted_orientation_rad);
  for (const auto& p : fit.parameters) {
    auto& parameter = *message.add_parameters();
    parameter.set_name(p.name);
    parameter.set_value(p.value);
    parameter.set_standard_error(p.standard_error);
    parameter.set_nominal(p.nominal);
    parameter.set_unit(p.unit);
  }
  for (const TargetErrorPoint& point : stored.target_error) {
    auto& error = *message.add_target_error();
    fill_vector(point.position_mm, *error.mutable_position_mm());
    for (int row = 0; row < 3; ++row) {
      for (int column = row; column < 3; ++column)
        error.add_covariance_mm2(point.covariance_mm2(row, column));
    }
  }
}

}  // namespace hapticd::server
