#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "hal/error.h"
#include "hal/lock/callback.h"
#include "server/calibration/estimate/streams.h"

namespace hapticd::calibration {

/// Place of the tip on the marker's body.
struct PivotFit {
  Eigen::Vector3d tip_in_marker_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d pivot_mm = Eigen::Vector3d::Zero();  ///< place of the tip, tracker's frame
  Eigen::Matrix3d covariance_mm2 = Eigen::Matrix3d::Zero();
  double residual_rms_mm = 0.0;  ///< says nothing about the error of the tip
  double tilt_deg =
      0.0;  ///< standard deviation of the tool's turn about the axis it turned about second most
  std::size_t poses = 0;
  std::size_t outliers = 0;
};

/// Finds the tip on the marker's body; the tip rests in a hollow while the tool turns about it: rotation ·
/// tip + position = pivot for every pose. Linear least squares with Tukey's weights; the covariance grows
/// with how much whole seconds agree. Refuses fewer than 40 poses, poses without orientation, a tool that
/// turned too little (standard error above 0.5 mm), a tip that slid, and a fit that was given up, which it
/// asks in each round.
hal::Result<PivotFit> fit_pivot(
    const std::vector<ReferencePose>& reference, const Callback<bool()>& given_up = [] { return false; });

}  // namespace hapticd::calibration
