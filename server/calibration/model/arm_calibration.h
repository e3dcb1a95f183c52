#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>

#include "hal/samples.h"
#include "rt/arm/corrected_pose.h"
#include "rt/arm/rigid_transform.h"

namespace hapticd::calibration {

/// Frames of a pose. All are right-handed, in millimetres.
enum class Frame : std::uint8_t {
  kRig,        ///< that of every sample: z up
  kDevice,     ///< the arm's base: origin where the first two axes cross, z along the first one
  kReference,  ///< that of the tracker (visual system) the rig was registered to
};

/// Place of each parameter in ArmCalibration::covariance. Rotations are small turns, rad, about the axes of
/// the frame they lead to.
namespace parameter {
inline constexpr int kJointGain = 0;      ///< 3, 1
inline constexpr int kJointOffset = 3;    ///< 3, rad
inline constexpr int kLink = 6;           ///< 2, mm
inline constexpr int kGimbalGain = 8;     ///< 3, 1
inline constexpr int kGimbalOffset = 11;  ///< 3, rad
inline constexpr int kTipOffset = 14;     ///< 3, mm, tool frame
inline constexpr int kRotation = 17;      ///< 3, rad, of reference_from_rig
inline constexpr int kTranslation = 20;   ///< 3, mm, of reference_from_rig
inline constexpr int kCount = 23;
}  // namespace parameter
using ParameterCovariance = Eigen::Matrix<double, parameter::kCount, parameter::kCount>;

/// What a calibration found: how the device's angles become the tip's pose (its base), and where the rig is
/// in the tracker's frame. A plain value: never changed once it is made; functions on it are pure, take no
/// lock and allocate nothing.
struct ArmCalibration : rt::ArmCorrection {
  std::string name;         ///< hash of the stored model; empty before it is stored
  bool registered = false;  ///< reference_from_rig was found; otherwise it is the identity
  rt::RigidTransform reference_from_rig;
  rt::RigidTransform device_from_rig;
  double tracker_latency_s = 0.0;  ///< by which the tracker's stamps are later than what they show
  double tracker_latency_sd_s = 0.0;
  ParameterCovariance covariance = ParameterCovariance::Zero();
  /// What the parameters cannot explain (bending, play), as a separate covariance and standard deviation;
  /// measured on motion that was left out. Rig frame.
  Eigen::Matrix3d misfit_mm2 = Eigen::Matrix3d::Zero();
  double orientation_misfit_rad = 0.0;
};

/// Pose of the rig's frame in another one.
rt::CorrectedPose in_frame(const ArmCalibration& calibration, const rt::CorrectedPose& in_rig,
                           Frame frame) noexcept;

/// frame_from_rig.
rt::RigidTransform frame_from_rig(const ArmCalibration& calibration, Frame frame) noexcept;

/// Covariance of the corrected tip's position in the axes of `frame`, mm²: of all parameters that matter
/// there (those of the registration in the reference frame only), and the misfit. It is that of a
/// calibration, not of noise: errors at poses near each other are alike.
Eigen::Matrix3d position_covariance_mm2(const ArmCalibration& calibration, const hal::RigSample& sample,
                                        Frame frame = Frame::kReference) noexcept;

/// Standard deviation of the corrected orientation, rad: the root of the mean square turn, all three axes
/// together.
double orientation_sd_rad(const ArmCalibration& calibration, const hal::RigSample& sample,
                          Frame frame = Frame::kReference) noexcept;

}  // namespace hapticd::calibration
