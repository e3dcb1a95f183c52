#include "server/grpc/pose/pose_messages.h"

#include <fmt/format.h>

#include <algorithm>

#include "server/grpc/messages/telemetry_messages.h"

namespace hapticd::server {

namespace {

constexpr double kMinRateHz = 1.0;
constexpr double kMaxRateHz = 1000.0;
constexpr double kMaxAheadMs = 1e3 * pose::MotionPredictor::kMaxAheadS;

Refusal out_of_range(const char* field, double value, std::string limit, const char* remedy) {
  return {RefusalKind::kOutOfRange,
          {fmt::format("{} is out of range", field), fmt::format("SubscribePosesRequest.{}", field),
           fmt::format("{:g}", value), std::move(limit), remedy}};
}

void fill_eigen(const Eigen::Vector3d& vector, v1::Vector3& message) {
  message.set_x(vector.x());
  message.set_y(vector.y());
  message.set_z(vector.z());
}

void fill_covariance(const Eigen::Matrix3d& matrix, v1::Covariance3& message) {
  message.set_xx(matrix(0, 0));
  message.set_xy(matrix(0, 1));
  message.set_xz(matrix(0, 2));
  message.set_yy(matrix(1, 1));
  message.set_yz(matrix(1, 2));
  message.set_zz(matrix(2, 2));
}

v1::UtcState utc_state(UtcKeeping keeping) {
  switch (keeping) {
    case UtcKeeping::kSynchronized:
      return v1::UTC_STATE_SYNCHRONIZED;
    case UtcKeeping::kUnsynchronized:
      return v1::UTC_STATE_UNSYNCHRONIZED;
    case UtcKeeping::kUnknown:
      break;
  }
  return v1::UTC_STATE_UNKNOWN;
}

void fill_time(const pose::IssuedPose& issued, std::int64_t rig_ns, v1::PoseTime& time) {
  time.set_rig_ns(rig_ns);
  time.set_utc_state(utc_state(issued.utc.keeping));
  const auto daemon = issued.has_daemon_time ? issued.clock.daemon_time(rig_ns) : std::nullopt;
  if (!daemon) return;
  time.set_daemon_ns(daemon->time_ns);
  time.set_daemon_bound_ns(daemon->bound_ns);
  time.set_utc_ns(daemon->time_ns + issued.utc.utc_minus_monotonic_ns);
  time.set_utc_bound_ns(daemon->bound_ns + issued.utc.bound_ns);
}

void fill_event(const pose::IssuedPose& issued, v1::ContactEvent& event) {
  const pose::ContactEvent& contact = *issued.pose.contact;
  event.set_number(contact.number);
  fill_time(issued, contact.began.time_ns, *event.mutable_began());
  event.set_earliest_rig_ns(contact.began.earliest_ns);
  event.set_latest_rig_ns(contact.began.latest_ns);
  if (contact.declared_ns) event.set_declared_rig_ns(*contact.declared_ns);
  if (contact.tip_known) fill_eigen(contact.tip_mm, *event.mutable_position_mm());
  if (contact.ended_ns) event.set_ended_rig_ns(*contact.ended_ns);
  event.set_withdrawn(contact.withdrawn);
}

void fill_prediction(const pose::ToolPose& pose, v1::Prediction& prediction) {
  prediction.set_ahead_ms(1e-6 * static_cast<double>(pose.time_ns - pose.measured_ns));
  prediction.set_order(1);
  prediction.set_normal_is_held(pose.prediction.normal_is_held);
  prediction.set_error_mm(pose.prediction.error_mm);
  prediction.set_error_bound_mm(pose.prediction.error_bound_mm);
  prediction.set_assumed_acceleration_mm_per_s2(pose::MotionPredictor::kAssumedMmPerS2);
  prediction.set_error_rad(pose.prediction.error_rad);
}

void fill_scene(const pose::ToolPose& pose, v1::Pose& message) {
  if (pose.knows_contact) message.set_in_contact(pose.in_contact);
  if (pose.normal) fill_eigen(*pose.normal, *message.mutable_normal());
  if (pose.displacement_mm) message.set_displacement_mm(*pose.displacement_mm);
  if (pose.target_n_per_mm) message.set_target_stiffness_n_per_mm(*pose.target_n_per_mm);
  if (pose.reaction_n) message.set_reaction_force_n(*pose.reaction_n);
  if (pose.device_force_n) fill_eigen(*pose.device_force_n, *message.mutable_device_force_n());
  if (pose.inclusion_mm) {
    fill_eigen(*pose.inclusion_mm, *message.mutable_inclusion_mm());
    message.set_inclusion(pose.inclusion);
  }
  if (pose.angles.known) {
    for (const double angle : pose.angles.joint_rad) message.add_joint_rad(angle);
    for (const double angle : pose.angles.gimbal_rad) message.add_gimbal_rad(angle);
  }
}

}  // namespace

Outcome<WantedPoses> read_request(const v1::SubscribePosesRequest& request) {
  const double rate_hz = request.rate_hz();
  // Written so that NaN is refused, too.
  if (!(rate_hz >= kMinRateHz && rate_hz <= kMaxRateHz)) {
    return out_of_range("rate_hz", rate_hz, fmt::format("{:g} … {:g} Hz", kMinRateHz, kMaxRateHz),
                        "ask for the rate at which pictures are drawn, e.g. 60");
  }
  const double ahead_ms = request.predict_ms();
  if (!(ahead_ms >= 0.0 && ahead_ms <= kMaxAheadMs)) {
    return out_of_range(
        "predict_ms", ahead_ms, fmt::format("0 … {:g} ms", kMaxAheadMs),
        "ask for the time from the pose to the picture; what takes longer cannot be predicted");
  }
  WantedPoses wanted;
  wanted.rate_hz = rate_hz;
  wanted.pose.ahead_s = 1e-3 * ahead_ms;
  wanted.pose.uncorrected = request.uncorrected();
  switch (request.frame()) {
    case v1::POSE_FRAME_UNSPECIFIED:
    case v1::POSE_FRAME_RIG:
      wanted.pose.frame = pose::PoseFrame::kRig;
      break;
    case v1::POSE_FRAME_DEVICE:
      wanted.pose.frame = pose::PoseFrame::kDevice;
      break;
    case v1::POSE_FRAME_REFERENCE:
      wanted.pose.frame = pose::PoseFrame::kReference;
      break;
    default:
      return Refusal{
          RefusalKind::kInvalidArgument,
          {"unknown frame", "SubscribePosesRequest.frame", std::to_string(static_cast<int>(request.frame())),
           "RIG, DEVICE or REFERENCE", "ask for one of these, or for none to get the rig's"}};
  }
  if (request.uncorrected() && request.frame() == v1::POSE_FRAME_REFERENCE) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"poses in the reference frame are corrected", "SubscribePosesRequest.uncorrected", "true",
                    "false in POSE_FRAME_REFERENCE", "ask for uncorrected poses in the rig's frame"}};
  }
  return wanted;
}

std::string encode(const pose::IssuedPose& issued) {
  const pose::ToolPose& pose = issued.pose;
  v1::Pose message;
  fill_time(issued, pose.time_ns, *message.mutable_time());
  message.set_tick(pose.tick);
  message.set_frame(static_cast<v1::PoseFrame>(static_cast<int>(pose.frame) + 1));
  fill_eigen(pose.position_mm, *message.mutable_position_mm());
  v1::Quaternion& orientation = *message.mutable_orientation();
  orientation.set_w(pose.orientation.w());
  orientation.set_x(pose.orientation.x());
  orientation.set_y(pose.orientation.y());
  orientation.set_z(pose.orientation.z());
  fill_eigen(pose.velocity_mm_per_s, *message.mutable_velocity_mm_per_s());
  fill_eigen(pose.angular_rad_per_s, *message.mutable_angular_velocity_rad_per_s());
  fill_eigen(pose.bending_mm, *message.mutable_bending_mm());
  fill_covariance(pose.covariance_mm2, *message.mutable_position_covariance_mm2());
  if (pose.orientation_sd_rad) {
    const double variance = *pose.orientation_sd_rad * *pose.orientation_sd_rad / 3.0;
    fill_covariance(Eigen::Matrix3d::Identity() * variance, *message.mutable_orientation_covariance_rad2());
  }
  for (int i = 0; i < 4; ++i) {
    if ((pose.error_sources >> static_cast<unsigned>(i) & 1U) != 0) {
      message.add_error_sources(static_cast<v1::PoseErrorSource>(i + 1));
    }
  }
  message.set_calibration(pose.calibration);
  fill_prediction(pose, *message.mutable_prediction());
  if (pose.contact) fill_event(issued, *message.mutable_contact());
  fill_scene(pose, message);
  message.set_status_bits(pose.status);
  return message.SerializeAsString();
}

}  // namespace hapticd::server
