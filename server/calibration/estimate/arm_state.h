#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "server/calibration/estimate/arm_fit.h"

namespace hapticd::calibration {

/// All that the fit moves, and how residuals follow from it.
namespace unknown {
inline constexpr int kArm = 0;  ///< 14, as in parameter::kJointGain … kGimbalOffset
inline constexpr int kRotation = 14;
inline constexpr int kTranslation = 17;
inline constexpr int kMarker = 20;
inline constexpr int kMarkerTurn = 23;
inline constexpr int kLatency = 26;
inline constexpr int kDrift = 27;
inline constexpr int kPlay = 28;  ///< 3, rad: by which each gimbal angle stays behind its motion
inline constexpr int kCount = 31;
}  // namespace unknown
using UnknownVector = Eigen::Matrix<double, unknown::kCount, 1>;
using UnknownMatrix = Eigen::Matrix<double, unknown::kCount, unknown::kCount>;

struct ArmState {
  rt::ArmModel arm;
  rt::ArmModel nominal;
  rt::RigidTransform reference_from_rig;
  Eigen::Vector3d marker_mm = Eigen::Vector3d::Zero();  ///< from the wrist, tool frame
  Eigen::Quaterniond tool_from_marker = Eigen::Quaterniond::Identity();
  double latency_s = 0.0;
  double drift = 0.0;
  /// Known, so that what play holds back is not taken for latency. It corrects no pose: a sample does not say
  /// which way its gimbal moves.
  Eigen::Vector3d play_rad = Eigen::Vector3d::Zero();
  double drift_origin_s = 0.0;  ///< stamp from which the drift counts

  ArmState moved(const UnknownVector& step) const;
  double rig_time_s(double stamp_s) const { return stamp_s - latency_s - drift * (stamp_s - drift_origin_s); }
};

/// Wrist and tool by the state's arm, rig frame; without the play.
rt::RigidTransform tool_pose(const ArmState& state, const RigPose& pose);

/// What is seen minus what the state says: position mm, then the turn in the marker's frame, rad (zero
/// without orientation). Nothing if the rig has no pose then.
using PoseResidual = Eigen::Matrix<double, 6, 1>;
std::optional<PoseResidual> residual_of(const ArmState& state, const RigStream& rig,
                                        const ReferencePose& seen);

/// Residual with the tip's place in the first three: where the marker says the tip is, minus where the state
/// has it, `tip_offset_mm` from the wrist. Without orientation: the marker's place.
std::optional<PoseResidual> target_residual_of(const ArmState& state, const RigStream& rig,
                                               const ReferencePose& seen);

/// Unknowns that a method moves.
std::array<bool, unknown::kCount> active_unknowns(FitMethod method, rt::AngleUse use, bool has_orientation,
                                                  bool clock_drifts);

/// What is known of them beforehand: standard deviations; 0 = nothing.
UnknownVector prior_sd();

}  // namespace hapticd::calibration
