#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/samples.h"
#include "server/pose/contact_follower.h"
#include "server/pose/motion_predictor.h"

namespace hapticd::pose {

/// Frame of a pose; as v1.PoseFrame.
enum class PoseFrame : std::uint8_t { kRig, kDevice, kReference };

/// What a subscriber wants of each pose.
struct PoseRequest {
  double ahead_s = 0.0;
  PoseFrame frame = PoseFrame::kRig;
  bool uncorrected = false;

  friend bool operator==(const PoseRequest&, const PoseRequest&) = default;
};

/// What the loaded scene says that poses need.
struct SceneFacts {
  std::optional<hal::Vector3> press_axis;      ///< of a one-dimensional scene: into the object, rig frame
  double structural_stiffness_n_per_mm = 0.0;  ///< 0 = not known: no bending is taken out
};

/// Sources of error that a covariance takes into account.
namespace error_source {
inline constexpr std::uint32_t kResolution = 1U << 0;
inline constexpr std::uint32_t kBending = 1U << 1;
inline constexpr std::uint32_t kPrediction = 1U << 2;
inline constexpr std::uint32_t kCalibration = 1U << 3;
}  // namespace error_source

/// The tool at one instant, in the frame of the request; as v1.Pose. Millimetres, seconds, radians, newtons.
struct ToolPose {
  PoseFrame frame = PoseFrame::kRig;
  std::uint64_t tick = 0;
  std::int64_t measured_ns = 0;  ///< rig's clock: of the encoders' reading
  std::int64_t time_ns = 0;      ///< what the pose is for: so far ahead of it
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_mm_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d bending_mm = Eigen::Vector3d::Zero();  ///< in position_mm
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  std::optional<double> orientation_sd_rad;  ///< all three axes together; nothing if it is not known
  std::uint32_t error_sources = 0;
  std::string calibration;
  PredictedMotion prediction;  ///< its error; position and covariance are those above

  bool knows_contact = false;
  bool in_contact = false;
  std::optional<ContactEvent> contact;  ///< tip_mm in the frame
  std::optional<Eigen::Vector3d> normal;
  std::optional<double> displacement_mm, target_n_per_mm, reaction_n;
  std::optional<Eigen::Vector3d> device_force_n;
  std::optional<Eigen::Vector3d> inclusion_mm;
  std::uint32_t inclusion = 0;
  hal::DeviceAngles angles;
  std::uint32_t status = 0;
};

}  // namespace hapticd::pose
