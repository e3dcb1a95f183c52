#pragma once

#include <cstddef>
#include <vector>

#include "server/calibration/estimate/arm_state.h"

namespace hapticd::calibration {

/// One of the tracker's poses in the fit.
struct FitRow {
  const ReferencePose* seen = nullptr;
  PoseResidual residual = PoseResidual::Zero();
  Eigen::Matrix<double, 6, unknown::kCount> jacobian = Eigen::Matrix<double, 6, unknown::kCount>::Zero();
  double position_weight = 0.0;  ///< 0 … 1, 0 for an outlier
  double turn_weight = 0.0;
};

struct Solved {
  ArmState state;
  std::vector<FitRow> rows;  ///< in order of time, with what they are at the end
  double noise_mm = 0.0;     ///< of one coordinate, robust: of all that the state does not explain
  double noise_rad = 0.0;
  UnknownMatrix information = UnknownMatrix::Zero();  ///< active ones, weighted by the noise, with the prior
  UnknownVector prior_information = UnknownVector::Zero();
  std::array<bool, unknown::kCount> active{};
};

/// Solves from a start that is near. Once it is given up, which it asks several times a step, what it returns
/// is worth nothing.
Solved solve_arm(const RigStream& rig, const std::vector<const ReferencePose*>& seen, const ArmState& start,
                 const std::array<bool, unknown::kCount>& active, const Callback<bool()>& given_up);

}  // namespace hapticd::calibration
