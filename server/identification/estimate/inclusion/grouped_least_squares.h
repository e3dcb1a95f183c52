#pragma once

#include <Eigen/Dense>
#include <cstddef>
#include <functional>
#include <vector>

namespace hapticd::rt {

struct LeastSquaresSolution {
  Eigen::VectorXd parameters;
  Eigen::VectorXd standard_errors;
  double rms = 0.0;  ///< of the residuals
  bool converged = false;
};

/// Least squares by Levenberg and Marquardt with numeric slopes, `steps` wide, between `low` and `high`; the
/// covariance by the sandwich over groups, for the residuals of one group (a press) are not independent.
/// `group_of`: of each residual; those of a group follow each other.
LeastSquaresSolution grouped_least_squares(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals, Eigen::VectorXd start,
    const Eigen::VectorXd& steps, const Eigen::VectorXd& low, const Eigen::VectorXd& high,
    const std::vector<std::size_t>& group_of);

}  // namespace hapticd::rt
