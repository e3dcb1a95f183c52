#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "server/calibration/estimate/streams.h"
#include "server/calibration/model/arm_calibration.h"

namespace hapticd::calibration {

/// What is estimated; the first two are there to be compared with.
enum class FitMethod : std::uint8_t {
  kRigid,  ///< where the rig is in the tracker's frame, and the marker on the tool; as if nothing were late
  kRigidLatency,  ///< that and the tracker's latency (registration)
  kArmNoLatency,  ///< that and the arm, as if nothing were late
  kArm,           ///< all of it
};

struct ArmFitSettings {
  FitMethod method = FitMethod::kArm;
  double earliest_s = -0.1;  ///< of the offset of the tracker's stamps, for the start
  double latest_s = 0.5;
  bool clock_drifts = false;  ///< the tracker has its own clock: estimate how much faster it runs
  /// Vector from the marker to the tip, marker frame, if a pivot found it; its covariance. Without, the tip
  /// is where the device has it.
  std::optional<Eigen::Vector3d> tip_in_marker_mm{};
  Eigen::Matrix3d tip_covariance_mm2 = Eigen::Matrix3d::Zero();
  /// Number of poses that are fitted, evenly spaced if there are more: each takes 2 kB.
  std::size_t max_poses = 30'000;
  Callback<bool()> given_up = [] { return false; };  ///< asked often; a fit that is given up is refused
};

/// One parameter as found.
struct FoundParameter {
  std::string name;
  double value = 0.0;
  double standard_error = 0.0;
  double nominal = 0.0;
  std::string unit;
};

/// A calibration and how far it can be believed.
struct ArmFit {
  ArmCalibration calibration;
  rt::RigidTransform tool_from_marker;  ///< where the marker is on the tool
  double clock_drift = 0.0;             ///< the tracker's clock gains so much a second
  double latency_s = 0.0;
  double latency_sd_s = 0.0;
  std::size_t poses = 0;     ///< of the tracker that had one of the rig's
  std::size_t outliers = 0;  ///< among them: left out
  bool has_orientation = false;
  double tracker_noise_mm = 0.0;  ///< of one coordinate; what changes from pose to pose
  double tracker_noise_rad = 0.0;
  double residual_rms_mm = 0.0;  ///< of the poses it was fitted to. Says nothing about the target error
  double left_out_rms_mm = 0.0;  ///< of poses it was not fitted to, blocks of time; with the tracker's noise
  double left_out_place_rms_mm = 0.0;  ///< likewise, regions of the workspace
  /// Predicted target error where the tip was: root of the trace of the covariance, quantiles, mm.
  double predicted_median_mm = 0.0;
  double predicted_95_mm = 0.0;
  double predicted_rms_mm = 0.0;
  double predicted_orientation_rad = 0.0;
  /// Blocks of time: offset of the stamps from the latency that was found, s; nan if nothing moved.
  std::vector<double> block_begin_s;
  std::vector<double> block_offset_s;
  std::vector<double> block_offset_sd_s;
  std::vector<FoundParameter> parameters;
};

/// Robust nonlinear least squares of the arm's angles against the tracker's poses: soft-L1, then Tukey's
/// biweight on the noise that the median of the residuals shows; Levenberg-Marquardt. The gauge: the zero of
/// joint 1 is the registration's, the zero of the last gimbal angle the marker's; both stay as the device has
/// them. Gains, zeros and lengths are held by what workshops achieve (5 %, 4 degrees, 8 mm), so that a motion
/// too small to show one leaves it uncertain, not wrong.
///
/// Covariance of the parameters: that of independent noise, times how much whole seconds of residuals agree
/// more than they would by chance. Misfit: what is alike in neighbouring residuals of blocks of time that
/// were left out (their noise is not), less what the parameters' covariance explains there.
hal::Result<ArmFit> fit_arm(const RigStream& rig, const std::vector<ReferencePose>& reference,
                            const rt::ArmModel& nominal, const ArmFitSettings& settings);

}  // namespace hapticd::calibration
