#include "rt/arm/corrected_pose.h"

namespace hapticd::rt {

namespace {

Eigen::Quaterniond reported_orientation(const hal::RigSample& sample) noexcept {
  const hal::Quaternion& q = sample.tip_orientation;
  return Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
}

}  // namespace

bool angles_serve(const ArmModel& arm, const hal::RigSample& sample) noexcept {
  return arm.use != AngleUse::kNone && sample.angles.known;
}

CorrectedPose correct(const ArmCorrection& correction, const hal::RigSample& sample) noexcept {
  const ArmModel& arm = correction.arm;
  if (!angles_serve(arm, sample)) {
    const hal::Vector3& p = sample.tip_position_mm;
    return {Eigen::Vector3d(p.x, p.y, p.z), reported_orientation(sample), PoseSource::kReported};
  }
  CorrectedPose pose;
  if (arm.use == AngleUse::kPose) {
    pose.orientation = tool_orientation(arm, sample.angles);
    pose.source = PoseSource::kAllAngles;
  } else {
    pose.orientation =
        (link_orientation(arm, sample.angles) *
         link_orientation(correction.nominal, sample.angles).conjugate() * reported_orientation(sample))
            .normalized();
    pose.source = PoseSource::kJointAngles;
  }
  pose.tip_mm = wrist_mm(arm, sample.angles) + pose.orientation * arm.tip_offset_mm;
  return pose;
}

}  // namespace hapticd::rt
