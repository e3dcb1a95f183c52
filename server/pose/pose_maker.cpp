#include "server/pose/pose_maker.h"

#include <cmath>

namespace hapticd::pose {

namespace {

Eigen::Vector3d vector(const hal::Vector3& v) noexcept {
  return {v.x, v.y, v.z};
}
Eigen::Quaterniond rotation(const hal::Quaternion& q) noexcept {
  const Eigen::Quaterniond read(q.w, q.x, q.y, q.z);
  const double length = read.norm();
  return length > 1e-6 && std::isfinite(length) ? Eigen::Quaterniond(read.coeffs() / length)
                                                : Eigen::Quaterniond::Identity();
}

/// Sample with what the arm's calibration needs of a record.
hal::RigSample sample_of(const rt::TickRecord& record) noexcept {
  hal::RigSample sample;
  sample.tick = record.tick;
  sample.time_ns = record.time_ns;
  sample.tip_position_mm = record.tip_position_mm;
  sample.tip_orientation = record.tip_orientation;
  if ((record.channels & rt::channel::kAngles) != 0) sample.angles = record.angles;
  sample.status = record.sample_status;
  return sample;
}

/// Takes all of a pose but its error from the rig's frame into another.
void turn(ToolPose& pose, const Eigen::Quaterniond& q, const Eigen::Vector3d& translation_mm) {
  const Eigen::Matrix3d r = q.toRotationMatrix();
  const auto point = [&](Eigen::Vector3d& p) { p = r * p + translation_mm; };
  const auto direction = [&](Eigen::Vector3d& v) { v = r * v; };
  point(pose.position_mm);
  pose.orientation = (q * pose.orientation).normalized();
  direction(pose.velocity_mm_per_s);
  direction(pose.angular_rad_per_s);
  direction(pose.bending_mm);
  pose.covariance_mm2 = r * pose.covariance_mm2 * r.transpose();
  if (pose.contact) point(pose.contact->tip_mm);
  if (pose.normal) direction(*pose.normal);
  if (pose.device_force_n) direction(*pose.device_force_n);
  if (pose.inclusion_mm) point(*pose.inclusion_mm);
}

}  // namespace

PoseMaker::PoseMaker(const hal::DeviceInfo& device, const DeviceFrame& frame)
    : device_(device), frame_(frame), motion_(device.position_resolution_mm) {}

std::optional<Eigen::Vector3d> PoseMaker::normal(const SceneFacts& scene) const noexcept {
  if ((last_.channels & rt::channel::kContact) == 0 || !last_.in_contact) return std::nullopt;
  if ((last_.channels & rt::channel::kDirection) != 0) {
    const Eigen::Vector3d n = vector(last_.normal);
    const double length = n.norm();
    if (length > 0.5 && std::isfinite(length)) return Eigen::Vector3d(n / length);
    return std::nullopt;
  }
  if (!scene.press_axis) return std::nullopt;
  return Eigen::Vector3d(-vector(*scene.press_axis).normalized());
}

void PoseMaker::follow(const rt::TickRecord& record, const SceneFacts& scene) noexcept {
  last_ = record;
  scene_ = scene;
  begun_ = true;
  motion_.follow({measured_ns(), vector(record.tip_position_mm), rotation(record.tip_orientation),
                  vector(record.angular_velocity_rad_per_s), normal(scene)});
  contact_.follow(record, motion_.path());
}

// Bending of the device. If it pushes the tip away from the hand, the tip is deeper than the encoders say: p
// = p_s - f/k.
Eigen::Vector3d PoseMaker::bending_mm() const noexcept {
  const double stiffness = scene_.structural_stiffness_n_per_mm;
  if (!(stiffness > 0.0) || (last_.channels & rt::channel::kGuard) == 0) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d bent = vector(last_.device_command_n) / -stiffness;
  return bent.allFinite() ? bent : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

void PoseMaker::fill_scene(ToolPose& pose) const {
  using namespace rt::channel;
  const std::uint32_t channels = last_.channels;
  pose.knows_contact = (channels & kContact) != 0;
  if (pose.knows_contact) {
    pose.in_contact = last_.in_contact;
    pose.contact = contact_.event();
    pose.normal = normal(scene_);
    if ((channels & kMotion) != 0) pose.reaction_n = last_.reaction_force_n;
  }
  if ((channels & kDeformation) != 0) pose.displacement_mm = last_.displacement_mm;
  if ((channels & kTarget) != 0) pose.target_n_per_mm = last_.target_stiffness_n_per_mm;
  if ((channels & kGuard) != 0) pose.device_force_n = vector(last_.device_command_n);
  if ((channels & kInclusion) != 0) {
    pose.inclusion_mm = vector(last_.inclusion_position_mm);
    pose.inclusion = last_.inclusion;
  }
  if ((channels & kAngles) != 0) pose.angles = last_.angles;
  pose.status = last_.sample_status;
}

ToolPose PoseMaker::pose(const PoseRequest& request, const calibration::ArmCalibration* calibration) const {
  const bool corrects = calibration != nullptr && !request.uncorrected && request.frame != PoseFrame::kDevice;
  ToolPose pose;
  pose.frame = request.frame;
  pose.tick = last_.tick;
  pose.measured_ns = measured_ns();
  pose.time_ns = pose.measured_ns + std::llround(1e9 * request.ahead_s);
  pose.prediction = motion_.ahead(request.ahead_s);
  pose.position_mm = pose.prediction.position_mm;
  pose.orientation = pose.prediction.orientation;
  pose.velocity_mm_per_s = motion_.velocity_mm_per_s();
  pose.angular_rad_per_s = vector(last_.angular_velocity_rad_per_s);
  fill_scene(pose);

  const double resolution = device_.position_resolution_mm;
  pose.covariance_mm2 =
      pose.prediction.covariance_mm2 + Eigen::Matrix3d::Identity() * (resolution * resolution / 12.0);
  pose.error_sources = error_source::kResolution;
  if (request.ahead_s > 0.0) pose.error_sources |= error_source::kPrediction;
  if (corrects) {
    // The correction of the measured pose is that of the predicted one, too: it changes little on the way.
    const hal::RigSample sample = sample_of(last_);
    const rt::CorrectedPose fixed = rt::correct(*calibration, sample);
    const Eigen::Vector3d shift_mm = fixed.tip_mm - vector(last_.tip_position_mm);
    const Eigen::Quaterniond turn_by = fixed.orientation * rotation(last_.tip_orientation).conjugate();
    pose.position_mm += shift_mm;
    pose.orientation = (turn_by * pose.orientation).normalized();
    if (pose.contact) pose.contact->tip_mm += shift_mm;
    pose.covariance_mm2 +=
        calibration::position_covariance_mm2(*calibration, sample, calibration::Frame::kRig);
    pose.orientation_sd_rad =
        std::hypot(calibration::orientation_sd_rad(*calibration, sample,
                                                   request.frame == PoseFrame::kReference
                                                       ? calibration::Frame::kReference
                                                       : calibration::Frame::kRig),
                   pose.prediction.error_rad);
    pose.error_sources |= error_source::kCalibration;
    pose.calibration = calibration->name;
  }
  if (!request.uncorrected) {
    pose.bending_mm = bending_mm();
    pose.position_mm += pose.bending_mm;
    if (scene_.structural_stiffness_n_per_mm > 0.0) pose.error_sources |= error_source::kBending;
    pose.covariance_mm2 += kBendingError * kBendingError * pose.bending_mm * pose.bending_mm.transpose();
  }

  if (request.frame == PoseFrame::kDevice) {
    const Eigen::Quaterniond to_device = rotation(frame_.to_rig).conjugate();
    turn(pose, to_device, vector(frame_.origin_mm));
  } else if (request.frame == PoseFrame::kReference && calibration != nullptr) {
    const rt::RigidTransform& to_reference = calibration->reference_from_rig;
    turn(pose, to_reference.rotation, to_reference.translation_mm);
    if (corrects) {
      // With that of the registration, in the reference's axes.
      const hal::RigSample sample = sample_of(last_);
      const Eigen::Matrix3d r = to_reference.rotation.toRotationMatrix();
      pose.covariance_mm2 +=
          calibration::position_covariance_mm2(*calibration, sample, calibration::Frame::kReference) -
          r * calibration::position_covariance_mm2(*calibration, sample, calibration::Frame::kRig) *
              r.transpose();
    }
  }
  return pose;
}

}  // namespace hapticd::pose
