#include <Eigen/SVD>

#include "server/linear_algebra/linear_algebra.h"

namespace hapticd::linear_algebra {

using Eigen::MatrixXd;

ConditionedSolution solve_by_singular_values(const MatrixView& a, const VectorView& b) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeThinU | Eigen::ComputeThinV);
  return {svd.solve(b), svd.singularValues()(a.cols() - 1) / svd.singularValues()(0)};
}

SingularValues3 singular_values(const Eigen::Matrix3d& a) {
  const Eigen::JacobiSVD<MatrixXd> svd(a, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.singularValues(), svd.matrixV()};
}

}  // namespace hapticd::linear_algebra
