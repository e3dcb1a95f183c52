#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/calibration/estimate/arm_solver.h"

namespace hapticd::calibration {

/// What poses say that were left out of the fit.
struct LeftOut {
  double rms_mm = 0.0;  ///< of the marker's place, outliers apart; with the tracker's noise
  Eigen::Matrix3d alike_mm2 =
      Eigen::Matrix3d::Zero();   ///< of the tip's error, without the noise; not exactly positive
  double alike_turn_rad2 = 0.0;  ///< mean square turn, without the noise
  double noise_mm = 0.0;         ///< of one coordinate of the marker
  double noise_rad = 0.0;        ///< of one of its turns
};

/// The rows' groups: whole blocks of time, a fifth of them at once; or the octants of the workspace.
std::vector<int> groups_by_time(const std::vector<FitRow>& rows);
std::vector<int> groups_by_place(const ArmState& state, const RigStream& rig,
                                 const std::vector<FitRow>& rows);

/// Leaves out one group after the other, by one Newton step from the fit of all. Noise of a tracker differs
/// from pose to pose and errors of an arm do not: the covariance of neighbours is the errors' alone.
LeftOut leave_out(const Solved& solved, const RigStream& rig, const std::vector<int>& groups);

/// Factor, ≥ 1, by which whole seconds of residuals agree more than independent ones would: a factor on the
/// covariance of the parameters (after Liang and Zeger 1986).
double agreement(const Solved& solved);

}  // namespace hapticd::calibration
