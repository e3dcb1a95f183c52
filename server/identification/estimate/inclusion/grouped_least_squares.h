#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

namespace hapticd::identification {

/// Knowledge of a parameter without the data.
struct PriorKnowledge {
  Eigen::Index parameter = 0;
  double value = 0.0;
  double standard_deviation = 1.0;
};

struct LeastSquaresSolution {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd standard_errors;
  double rms = 0.0;  ///< of the residuals
  bool converged = false;
};

/// Least squares by Levenberg and Marquardt with numeric slopes, `steps` wide, between `low` and `high`.
/// The residuals of one group (a press) are not independent: the covariance is that of the jackknife over
/// groups, linearised, and what the priors leave open. What a law leaves over is much the same in all groups:
/// a prior that is off by its deviation counts as much as all of it, however many the samples are, while
/// noise that is independent from sample to sample averages out. `group_of`: group of each residual; those of
/// a group follow each other. `components`: residuals of one sample.
LeastSquaresSolution grouped_least_squares(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& residuals, Eigen::VectorXd start,
    const Eigen::VectorXd& steps, const Eigen::VectorXd& low, const Eigen::VectorXd& high,
    const std::vector<std::size_t>& group_of, const std::vector<PriorKnowledge>& priors = {},
    std::size_t components = 1);

}  // namespace hapticd::identification
