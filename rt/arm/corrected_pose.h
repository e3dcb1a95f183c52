#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

#include "hal/samples.h"
#include "rt/arm/arm_model.h"

namespace hapticd::rt {

/// What a calibration found of an arm: how the device's angles become the tip's pose. Functions on it are
/// pure, take no lock and allocate nothing.
struct ArmCorrection {
  ArmModel nominal;  ///< as the device describes itself
  ArmModel arm;      ///< as it was found to be
};

/// What a corrected pose was made of.
enum class PoseSource : std::uint8_t {
  kReported,     ///< the pose of the sample as it is: the device reports no angles that can be used
  kJointAngles,  ///< position from the corrected joints; orientation as reported, turned with the arm
  kAllAngles,    ///< position and orientation from the corrected joints and gimbal
};

struct CorrectedPose {
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< tool coordinates into the rig's
  PoseSource source = PoseSource::kReported;
};

/// True if the sample's angles describe the arm.
bool angles_serve(const ArmModel& arm, const hal::RigSample& sample) noexcept;

/// Pose of the tip in the rig's frame. A sample with NaN gives a pose with NaN.
CorrectedPose correct(const ArmCorrection& correction, const hal::RigSample& sample) noexcept;

}  // namespace hapticd::rt
